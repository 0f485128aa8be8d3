// The engine chooses between uniforms one by one, as here, and a uniform buffer.
#include <pbrFragmentDeclaration>
