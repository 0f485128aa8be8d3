// The lit material of PlayCanvas with anisotropy along the tangent.
#include <lit>

vec3 anisotropic( vec3 light, vec3 view, vec3 color, float rough, float metal, float lamp, float strength ) {
	dAnisotropy = strength;
	dAnisotropyRotation = vec2( 1.0, 0.0 );
	return lit( light, view, color, rough, metal, vec3( 0.0 ), 0.0, lamp );
}
