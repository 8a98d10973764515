"""Many pieces of surface: the one mutable object, a graph of Darboux-frame patches."""
