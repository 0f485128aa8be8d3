// MeshPhysicalMaterial of three.js with a thin film.
#include <program>

vec3 iridescent( vec3 light, vec3 view, vec3 color, float rough, float metal, float strength, float filmIndex,
	float filmThickness ) {
	diffuse = color;
	roughness = rough;
	metalness = metal;
	ior = 1.5;
	specularColor = vec3( 1.0 );
	specularIntensity = 1.0;
	iridescence = strength;
	iridescenceIOR = filmIndex;
	iridescenceThicknessMinimum = 0.0;
	iridescenceThicknessMaximum = filmThickness;
	return lit( light, view );
}
