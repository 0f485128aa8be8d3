"""WGSL to a module: words (`tokens`), grammar (`parser`), Bevy's directives (`preprocessor`, `sources`), and
instructions (`translation`). A text is untrusted: depth, words and numbers are bounded, and nothing runs.
"""

from .translation import translated as translated
