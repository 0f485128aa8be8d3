// MeshPhysicalMaterial of three.js with anisotropy along the tangent.
#include <program>

vec3 anisotropic( vec3 light, vec3 view, vec3 color, float rough, float metal, float strength ) {
	diffuse = color;
	roughness = rough;
	metalness = metal;
	ior = 1.5;
	specularColor = vec3( 1.0 );
	specularIntensity = 1.0;
	anisotropyVector = vec2( strength, 0.0 );
	vTangent = vec3( 1.0, 0.0, 0.0 );
	vBitangent = vec3( 0.0, 1.0, 0.0 );
	return lit( light, view );
}
