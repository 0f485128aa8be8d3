// MeshStandardMaterial of three.js.
#include <program>

vec3 standard( vec3 light, vec3 view, vec3 color, float rough, float metal ) {
	diffuse = color;
	roughness = rough;
	metalness = metal;
	return lit( light, view );
}
