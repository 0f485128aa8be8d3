// The engine chooses between single uniforms, which are used here, and a uniform buffer.
#include <pbrFragmentDeclaration>
