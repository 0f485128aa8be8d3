"""All materials, one file each, in folders by kind; to add one, add a file to any folder."""
