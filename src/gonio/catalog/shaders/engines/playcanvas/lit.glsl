// `litForwardBackend` and `lightFunctionLight` of PlayCanvas for a flat surface under one directional light: the chunks
// and their order are those of the package. Gloss is 1 - roughness.

#define LIT_SPECULAR
#define saturate( x ) clamp( x, 0.0, 1.0 )

vec3 dDiffuseLight;
vec3 dSpecularLight;
vec3 sSpecularLight;
vec4 sReflection;
float dAnisotropy;
vec2 dAnisotropyRotation;

#include <lit/frag/metalnessModulate>
#include <lit/frag/fresnelSchlick>
#include <lit/frag/lightDiffuseLambert>
#include <lobe>
#include <lit/frag/lightSheen>
#include <lit/frag/combine>

vec3 lit( vec3 light, vec3 view, vec3 color, float rough, float metal, vec3 sheen, float sheenRough, float lamp ) {
	vec3 normal = vec3( 0.0, 0.0, 1.0 );
	float gloss = 1.0 - rough;
	vec3 specularity = getSpecularModulate( vec3( 1.0 ), color, metal, 0.04, 1.0 );
	vec3 albedo = getAlbedoModulate( color, metal );
	vec3 towards = - light;
	float atten = getLightDiffuse( normal, view, towards );
	vec3 halfway = normalize( light + view );
	dDiffuseLight = vec3( atten * lamp );
	dSpecularLight = getLightSpecular( halfway, reflect( - view, normal ), normal, view, towards, gloss, mat3( 1.0 ) )
		* atten * lamp * getFresnel( dot( view, halfway ), gloss, specularity );
	sSpecularLight = vec3( 0.0 );
	sReflection = vec4( 0.0 );
	#ifdef LIT_SHEEN
	sSpecularLight += getLightSpecularSheen( halfway, normal, view, towards, sheenRough ) * atten * lamp;
	#endif
	return combineColor( albedo, sheen, 0.0 );
}
