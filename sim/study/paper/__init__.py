"""The paper's tables and figures, repeated on simulated stand-ins."""
