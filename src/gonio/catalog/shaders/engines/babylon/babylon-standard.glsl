// PBRMaterial of Babylon.js with the defaults of its class.
#include <program>

vec3 standard( vec3 light, vec3 view, vec3 color, float rough, float metal ) {
	return lit( light, view, color, rough, metal, 1.5 );
}
