// PBRMaterial of Babylon.js with `brdf.useLegacySpecularEnergyConservation = false`.
#include <program>

vec3 conserving( vec3 light, vec3 view, vec3 color, float rough, float metal, float index ) {
	return lit( light, view, color, rough, metal, index );
}
