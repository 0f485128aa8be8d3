"""Published models of 1982 to 2012, used in fits to measured materials."""
