// Metallic-roughness material of glTF-Sample-Viewer with KHR_materials_anisotropy.
#include <lamp>

vec3 anisotropic( vec3 light, vec3 view, vec3 color, float rough, float metal, float strength ) {
	return lamp( light, view, color, rough, metal, strength );
}
