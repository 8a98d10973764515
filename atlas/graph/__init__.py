"""Which patches meet, and where: sheets, cells, creases, frontier."""
