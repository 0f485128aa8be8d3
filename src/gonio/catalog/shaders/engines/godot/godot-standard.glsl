// StandardMaterial3D of Godot.
#include <lamp>

vec3 standard( vec3 light, vec3 view, vec3 color, float rough, float metal, float specular ) {
	return lamp( light, view, color, rough, metal, specular, 0.0, 0.0, 0.0 );
}
