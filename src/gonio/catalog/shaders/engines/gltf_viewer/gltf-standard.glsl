// Metallic-roughness material of glTF-Sample-Viewer.
#include <lamp>

vec3 standard( vec3 light, vec3 view, vec3 color, float rough, float metal ) {
	return lamp( light, view, color, rough, metal, 0.0 );
}
