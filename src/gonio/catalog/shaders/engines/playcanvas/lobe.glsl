// The chunk of the specular lobe, as the material chooses it.
#ifdef ANISOTROPIC
#include <lit/frag/lightSpecularAnisoGGX>
#else
#include <lit/frag/lightSpecularGGX>
#endif
