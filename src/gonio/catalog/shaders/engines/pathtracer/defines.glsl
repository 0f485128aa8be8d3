// Definitions of the chunk <common> of three.js.
#define PI 3.141592653589793
#define EPSILON 1e-6
#define saturate( a ) clamp( a, 0.0, 1.0 )
