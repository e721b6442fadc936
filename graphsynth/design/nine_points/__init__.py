"""Alt's problem: every four-bar whose coupler draws a path through nine points; seven or five with given pivots."""
