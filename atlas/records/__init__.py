"""Records that go into an atlas and come out of it: touches, changes, options."""
