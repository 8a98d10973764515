"""Which patches meet, and where: sheets, cells, frontier."""
