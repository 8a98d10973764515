"""What a run keeps: its options, its journal of touches, its folder."""
