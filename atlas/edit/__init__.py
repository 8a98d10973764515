"""Everything that changes an atlas: insert, renew, fill, finish."""
