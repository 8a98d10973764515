"""What must hold of every atlas, checked from its parts."""
