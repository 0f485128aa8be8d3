// MeshPhysicalMaterial of three.js, with clear coat and sheen; neither has an effect at 0.
#include <program>

vec3 physical( vec3 light, vec3 view, vec3 color, float rough, float metal, float index, vec3 specularTint,
	float specularWeight, float coat, float coatRoughness, vec3 sheen, float sheenWidth ) {
	diffuse = color;
	roughness = rough;
	metalness = metal;
	ior = index;
	specularColor = specularTint;
	specularIntensity = specularWeight;
	clearcoat = coat;
	clearcoatRoughness = coatRoughness;
	sheenColor = sheen;
	sheenRoughness = sheenWidth;
	return lit( light, view );
}
