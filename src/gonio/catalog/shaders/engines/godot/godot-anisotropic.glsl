// StandardMaterial3D of Godot with anisotropy.
#include <lamp>

vec3 anisotropic( vec3 light, vec3 view, vec3 color, float rough, float metal, float specular, float strength ) {
	return lamp( light, view, color, rough, metal, specular, 0.0, 0.0, strength );
}
