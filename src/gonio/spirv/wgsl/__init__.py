"""Translation of WGSL to a module: tokens (`tokens`), grammar (`parser`), Bevy's directives (`preprocessor`,
`sources`), and instructions (`translation`). Texts are untrusted: depth, tokens and numbers are bounded.
"""

from .translation import translated as translated
