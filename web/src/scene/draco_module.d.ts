declare module 'three/examples/jsm/libs/draco/draco_wasm_wrapper.js' {
  const make: (options: { wasmBinary: ArrayBuffer }) => Promise<import('./draco_block').Draco>;
  export default make;
}
