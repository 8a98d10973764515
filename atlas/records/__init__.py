"""What goes into an atlas and what comes out: touches, changes, options."""
