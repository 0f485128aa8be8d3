// A sampler cannot be a global variable.
#undef uniform
#include <ShadersInclude/pbrFragmentSamplersDeclaration>
#define uniform
