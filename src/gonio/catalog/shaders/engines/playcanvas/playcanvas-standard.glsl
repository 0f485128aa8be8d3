// The lit material of PlayCanvas: metalness workflow, GGX.
#include <lit>

vec3 standard( vec3 light, vec3 view, vec3 color, float rough, float metal, float lamp ) {
	return lit( light, view, color, rough, metal, vec3( 0.0 ), 0.0, lamp );
}
