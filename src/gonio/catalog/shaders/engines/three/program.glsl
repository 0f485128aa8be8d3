// The fragment program of three.js for a flat surface, lit by one directional light of irradiance 1, with linear output
// colors: the definitions that WebGLRenderer puts before the program, then the unchanged text of the package. Uniforms
// and varyings become globals, which Gonio's function assigns before it calls the program's main.

#define HIGH_PRECISION
#define NUM_SUN_LIGHTS 0
#define NUM_DIR_LIGHTS 1
#define NUM_POINT_LIGHTS 0
#define NUM_SPOT_LIGHTS 0
#define NUM_RECT_AREA_LIGHTS 0
#define NUM_HEMI_LIGHTS 0
#define NUM_LIGHT_PROBE_GRIDS 0
#define NUM_SPOT_LIGHT_COORDS 0
#define NUM_SPOT_LIGHT_MAPS 0
#define NUM_DIR_LIGHT_SHADOWS 0
#define NUM_POINT_LIGHT_SHADOWS 0
#define NUM_SPOT_LIGHT_SHADOWS 0
#define UNROLLED_LOOP_INDEX 0

#define gl_FragColor programColor
#define dFdx( p ) ( 0.0 * ( p ) )
#define dFdy( p ) ( 0.0 * ( p ) )
#undef varying
#define varying
#define uniform

vec4 programColor;
const mat4 viewMatrix = mat4( 1.0 );
const bool isOrthographic = false;

vec4 linearToOutputTexel( vec4 value ) { return value; }

#include <ShaderLib/meshphysical.glsl.js#fragment>

vec3 lit( vec3 light, vec3 view ) {
	vNormal = vec3( 0.0, 0.0, 1.0 );
	vViewPosition = view;
	directionalLights[ 0 ].direction = light;
	directionalLights[ 0 ].color = vec3( 1.0 );
	opacity = 1.0;
	main();
	return programColor.rgb;
}
