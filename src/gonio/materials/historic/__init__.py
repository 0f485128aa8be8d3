"""Published models of 1982 to 2012 that measured materials were fitted with."""
