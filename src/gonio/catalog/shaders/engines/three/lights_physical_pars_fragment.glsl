// A sampler cannot be a global variable.
#undef uniform
#include <ShaderChunk/lights_physical_pars_fragment>
#define uniform
