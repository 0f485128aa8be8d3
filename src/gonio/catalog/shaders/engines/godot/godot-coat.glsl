// StandardMaterial3D of Godot with clear coat.
#include <lamp>

vec3 coated( vec3 light, vec3 view, vec3 color, float rough, float metal, float specular, float coat, float coatRough ) {
	return lamp( light, view, color, rough, metal, specular, coat, coatRough, 0.0 );
}
