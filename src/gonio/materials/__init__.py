"""Every material, one file each, in folders by kind; a new one is one new file in any of them."""
