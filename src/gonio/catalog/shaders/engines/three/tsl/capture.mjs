// Prints the fragment programs of the node materials of three.js, as JSON by name: the code that WebGPURenderer passes
// to the device for one frame. The device is a substitute that draws nothing, thus Node suffices.
//
//     node capture.mjs node_modules/three/build/three.webgpu.js
import { pathToFileURL } from 'node:url';

// An object that has every property; each can be called and does nothing. `own` holds the properties with an effect.
const inert = ( own = {} ) => new Proxy( function () {}, {
	get: ( _, name ) => name in own || name === 'then' ? own[ name ] : name === Symbol.toPrimitive ? () => 0 : inert(),
	apply: () => inert(),
	construct: () => inert(),
} );

const programs = [], errors = [];
const device = inert( {
	features: new Set( [ 'core-features-and-limits' ] ),
	lost: new Promise( () => {} ),
	popErrorScope: async () => null,
	createBuffer: ( { size } ) => inert( { getMappedRange: () => new ArrayBuffer( size ) } ),
	createShaderModule: ( { code } ) => ( code.includes( '@fragment' ) && programs.push( code ), inert() ),
} );
for ( const name of [ 'GPUShaderStage', 'GPUBufferUsage', 'GPUTextureUsage' ] ) globalThis[ name ] = inert();
globalThis.GPURenderBundleEncoder = class {};
globalThis.requestAnimationFrame = () => 0;
globalThis.self = globalThis;
globalThis.navigator ??= {};
navigator.gpu ??= inert();
console.log = console.info = console.warn = () => {}; // only the result may be printed
console.error = ( ...words ) => errors.push( words.join( ' ' ) ); // three.js would use another material

const THREE = await import( pathToFileURL( process.argv[ 2 ] ) );
const { float, vec2, vec3, uniform, varyingProperty } = THREE.TSL;

// A light of irradiance 1, whose direction is an input of the fragment program, `lampDirection`.
class Lamp extends THREE.Light {}
class LampNode extends THREE.AnalyticLightNode {

	setupDirect() {

		return { lightDirection: varyingProperty( 'vec3', 'lampDirection' ), lightColor: vec3( 1 ) };

	}

}

// The properties of materials in their programs: a constant, or a uniform named after the parameter of Gonio's adapter
// of WebGLRenderer's program.
const number = ( name ) => uniform( 0.5 ).setName( name );
const color = ( name ) => uniform( new THREE.Color() ).setName( name );
const base = {
	color: color( 'color' ), roughness: number( 'rough' ), metalness: number( 'metal' ),
	opacity: float( 1 ), emissive: vec3( 0 ), emissiveIntensity: float( 1 ),
	ior: float( 1.5 ), specularColor: vec3( 1 ), specularIntensity: float( 1 ),
};
const MATERIALS = {
	standard: [ new THREE.MeshStandardNodeMaterial(), base ],
	physical: [ new THREE.MeshPhysicalNodeMaterial( { clearcoat: 1, sheen: 1 } ), {
		...base, ior: number( 'index' ),
		specularColor: color( 'specularTint' ), specularIntensity: number( 'specularWeight' ),
		clearcoat: number( 'coat' ), clearcoatRoughness: number( 'coatRoughness' ),
		sheen: float( 1 ), sheenColor: color( 'sheen' ), sheenRoughness: number( 'sheenWidth' ),
	} ],
	anisotropic: [ new THREE.MeshPhysicalNodeMaterial(), base ],
	iridescent: [ new THREE.MeshPhysicalNodeMaterial( { iridescence: 1 } ), {
		...base, iridescence: number( 'strength' ), iridescenceIOR: number( 'filmIndex' ),
	} ],
};
MATERIALS.anisotropic[ 0 ].anisotropyNode = vec2( number( 'strength' ), 0 );
MATERIALS.iridescent[ 0 ].iridescenceThicknessNode = number( 'filmThickness' );

const renderer = new THREE.WebGPURenderer( { canvas: inert( { width: 1, height: 1, style: {} } ), device } );
await renderer.init();
if ( Lamp.registerNode ) Lamp.registerNode( LampNode ); else renderer.library.addLight( LampNode, Lamp ); // before r187
renderer.setRenderTarget( new THREE.RenderTarget( 1, 1, { type: THREE.FloatType } ) ); // for linear output colors

function captured( material, properties ) {

	THREE.MaterialNode.prototype.getCache = ( name ) => properties[ name ];
	const plane = new THREE.PlaneGeometry();
	plane.setAttribute( 'tangent', new THREE.Float32BufferAttribute( Array( 4 ).fill( [ 1, 0, 0, 1 ] ).flat(), 4 ) );
	const scene = new THREE.Scene();
	scene.add( new THREE.Mesh( plane, material ), new Lamp() );
	const camera = new THREE.PerspectiveCamera();
	camera.position.z = 1;
	renderer.render( scene, camera );
	const program = programs.pop();
	if ( errors.length || ! program ) throw new Error( errors[ 0 ] ?? 'no fragment program' );
	return program;

}

const made = Object.entries( MATERIALS ).map( ( [ name, given ] ) => [ name, captured( ...given ) ] );
process.stdout.write( JSON.stringify( Object.fromEntries( made ) ) );
