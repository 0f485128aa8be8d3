// The chunk of the specular lobe, chosen by the material.
#ifdef ANISOTROPIC
#include <lit/frag/lightSpecularAnisoGGX>
#else
#include <lit/frag/lightSpecularGGX>
#endif
