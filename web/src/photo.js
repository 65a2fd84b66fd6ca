// The panorama's pixels, looked up exactly for each pixel of the view.

import {
  BufferAttribute,
  BufferGeometry,
  LinearFilter,
  Camera,
  Mesh,
  NoColorSpace,
  RawShaderMaterial,
  RepeatWrapping,
  Scene,
  GLSL3,
  Texture,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";

const VERTEX = `
in vec3 position;
out vec2 place;
void main() {
  place = position.xy;
  gl_Position = vec4(position, 1.0);
}`;

const FRAGMENT = `
precision highp float;
in vec2 place;
out vec4 colour;
uniform sampler2D photo;
uniform vec3 right, up, forward;
uniform vec2 extent;
const float PI = 3.14159265358979;
void main() {
  vec3 ray = normalize(forward + place.x * extent.x * right + place.y * extent.y * up);
  vec2 uv = vec2(atan(ray.x, ray.y) / (2.0 * PI) + 0.5, asin(clamp(ray.z, -1.0, 1.0)) / PI + 0.5);
  colour = vec4(texture(photo, uv).rgb, 1.0);
}`;

/** Draws the photo through a perspective lens. Throws where there is no WebGL. */
export class PhotoPainter {
  constructor(stage, image) {
    this.renderer = new WebGLRenderer({ alpha: false, antialias: false });
    this.renderer.domElement.classList.add("canvas");
    this.renderer.domElement.setAttribute("aria-hidden", "true");
    stage.prepend(this.renderer.domElement);
    const texture = new Texture(image);
    texture.colorSpace = NoColorSpace;
    texture.wrapS = RepeatWrapping;
    texture.minFilter = texture.magFilter = LinearFilter;
    texture.generateMipmaps = false;
    texture.needsUpdate = true;
    this.uniforms = {
      photo: { value: texture },
      right: { value: new Vector3() },
      up: { value: new Vector3() },
      forward: { value: new Vector3() },
      extent: { value: new Vector2() },
    };
    const triangle = new BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    triangle.setAttribute("position", new BufferAttribute(corners, 3));
    const material = new RawShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: this.uniforms,
      depthTest: false,
      glslVersion: GLSL3,
    });
    const mesh = new Mesh(triangle, material);
    mesh.frustumCulled = false;
    this.scene = new Scene();
    this.scene.add(mesh);
    this.camera = new Camera();
  }

  resize(width, height) {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height);
  }

  draw(lens) {
    const { right, up, forward, extent } = this.uniforms;
    right.value.set(...lens.right);
    up.value.set(...lens.up);
    forward.value.set(...lens.forward);
    const half = Math.tan(lens.fov / 2);
    extent.value.set((half * lens.width) / lens.height, half);
    this.renderer.render(this.scene, this.camera);
  }
}
