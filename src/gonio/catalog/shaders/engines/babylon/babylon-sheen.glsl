// PBRMaterial of Babylon.js with a separate roughness of the sheen, and `sheen.albedoScaling = true`.
#include <program>

vec3 sheened( vec3 light, vec3 view, vec3 color, float rough, float metal, vec3 sheen, float sheenRough ) {
	vSheenColor = vec4( sheen, 1.0 );
	vSheenRoughness = sheenRough;
	return lit( light, view, color, rough, metal, 1.5 );
}
