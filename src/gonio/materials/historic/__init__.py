"""Models published from 1982 to 2012 and used in fits to measured materials."""
