// PBRMaterial of Babylon.js with anisotropy along the tangent.
#include <program>

vec3 anisotropic( vec3 light, vec3 view, vec3 color, float rough, float metal, float strength ) {
	vTBN = mat3( 1.0 );
	vAnisotropy = vec3( 1.0, 0.0, strength );
	return lit( light, view, color, rough, metal, 1.5 );
}
