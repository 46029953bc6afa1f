"""How the parts make one actor."""
