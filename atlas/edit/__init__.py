"""Everything that changes an atlas: insert, merge, split, fill, finish."""
