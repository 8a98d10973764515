"""Studies: accuracy against speed, ours and peers'."""
