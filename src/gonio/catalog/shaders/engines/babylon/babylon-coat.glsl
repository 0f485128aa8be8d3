// PBRMaterial of Babylon.js with a clear coat of index 1.5.
#include <program>

vec3 coated( vec3 light, vec3 view, vec3 color, float rough, float metal, float coat, float coatRough ) {
	vClearCoatParams = vec2( coat, coatRough );
	vClearCoatRefractionParams = vec4( 0.04, 1.0 / 1.5, - 0.5, 2.5 );
	return lit( light, view, color, rough, metal, 1.5 );
}
