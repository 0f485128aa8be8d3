// The lit material of PlayCanvas with a white sheen.
#include <lit>

vec3 sheened( vec3 light, vec3 view, vec3 color, float rough, float metal, float lamp, float sheenRough ) {
	return lit( light, view, color, rough, metal, vec3( 1.0 ), sheenRough, lamp );
}
