// The three bodies, the camera and the lights. Drawn only when something changes.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { toCreasedNormals } from 'three/addons/utils/BufferGeometryUtils.js';
import { CutPlane } from './plane.js';

const colours = { outer: 0xe06c60, mesh: 0xd8d3ca, inner: 0x5284cc };
const crease = (40 * Math.PI) / 180;
const drawOrder = { inner: 1, mesh: 2, outer: 3 };  // from the inside, so that what is translucent shows it

function makeGeometry({ positions, indices }) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  geometry.setIndex(new THREE.BufferAttribute(indices, 1));
  return toCreasedNormals(geometry, crease);
}

export class Scene {
  constructor(canvas, data) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.localClippingEnabled = true;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(28, 1, 0.01, 40);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    this.up = data.up;
    this.cut = new CutPlane(data);
    this.scene.add(this.cut.object, this.cut.frame);
    this.addLights();
    this.bodies = {};
    for (const [name, body] of Object.entries(data.bodies)) if (body) this.addBody(name, body);
    this.bounds = new THREE.Box3();
    for (const { object } of Object.values(this.bodies)) this.bounds.expandByObject(object);
    this.resize();
    this.view('reset');
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  addLights() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa0aa, 1.7));
    const key = new THREE.DirectionalLight(0xffffff, 1.9), fill = new THREE.DirectionalLight(0xffffff, 0.5);
    key.position.set(-1.2, 1.6, 1.5);
    fill.position.set(2, -0.4, 0.8);
    this.camera.add(key, fill, key.target, fill.target);  // lights go with the eye
    this.scene.add(this.camera);
  }

  addBody(name, body) {
    const material = new THREE.MeshStandardMaterial({
      color: colours[name], roughness: 0.62, side: THREE.DoubleSide, clippingPlanes: [this.cut.clipping],
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    const object = new THREE.Mesh(makeGeometry(body), material);
    object.renderOrder = drawOrder[name];
    const edges = new THREE.Mesh(object.geometry, new THREE.MeshBasicMaterial({
      color: 0x14161a, wireframe: true, transparent: true, opacity: 0.22, clippingPlanes: [this.cut.clipping],
    }));
    edges.renderOrder = drawOrder[name] + 0.5;
    edges.visible = false;
    object.add(edges);
    this.scene.add(object);
    this.bodies[name] = { object, material, edges };
  }

  show(name, visible) {
    this.bodies[name].object.visible = visible;
    this.draw();
  }

  setOpacity(name, opacity) {
    const { material } = this.bodies[name];
    material.opacity = opacity;
    material.transparent = opacity < 1;
    material.depthWrite = opacity >= 1;
    material.needsUpdate = true;
    this.draw();
  }

  showEdges(visible) {
    for (const { edges } of Object.values(this.bodies)) edges.visible = visible;
    this.draw();
  }

  /// `field`: 'inside', 'everywhere' or 'off'.
  setCut(enabled, field) {
    for (const { material, edges } of Object.values(this.bodies))
      material.clippingPlanes = edges.material.clippingPlanes = enabled ? [this.cut.clipping] : [];
    this.cut.object.visible = enabled && field !== 'off';
    this.cut.frame.visible = enabled;
    this.cut.uniforms.insideOnly.value = field === 'inside';
    this.draw();
  }

  /// `at`: position of the plane within the model's extent along the normal, 0 to 1. Returns the offset.
  placeCut(normal, at) {
    const { min, max } = this.bounds;
    const centre = min.clone().add(max).multiplyScalar(0.5), half = max.clone().sub(centre);
    const reach = Math.abs(normal.x) * half.x + Math.abs(normal.y) * half.y + Math.abs(normal.z) * half.z;
    const offset = centre.dot(normal) + (2 * at - 1) * reach;
    this.cut.place(normal, offset);
    this.draw();
    return offset;
  }

  /// Right, front and up of the model: x, −y, z if z is up; the cyclic order is kept for other axes.
  frame() {
    const axis = (i) => new THREE.Vector3().setComponent((i + this.up + 1) % 3, 1);
    return this.up === 2 ? { right: axis(0), front: axis(1).negate(), up: axis(2) }
                         : { right: axis(1), front: axis(0), up: axis(2) };
  }

  view(name) {
    const { right, front, up } = this.frame();
    const mix = (a, b, c) => right.clone().multiplyScalar(a).addScaledVector(front, b).addScaledVector(up, c);
    const direction = {
      front: mix(0, 1, 0), back: mix(0, -1, 0), right: mix(1, 0, 0), left: mix(-1, 0, 0), top: mix(0, 0.001, 1),
      reset: mix(0.62, 1, 0.5),
    }[name].normalize();
    const centre = this.bounds.getCenter(new THREE.Vector3());
    this.camera.up.copy(up);
    this.camera.position.copy(centre).addScaledVector(direction, this.fittingDistance(centre, direction, up));
    this.controls.target.copy(centre);
    this.controls.update();
    this.draw();
  }

  /// How far away, in this direction, all corners of the bounds are in the picture, with a margin.
  fittingDistance(centre, direction, up) {
    const right = new THREE.Vector3().crossVectors(up, direction).normalize();
    const over = new THREE.Vector3().crossVectors(direction, right);
    const vertical = Math.tan((this.camera.fov * Math.PI) / 360) / 1.16, horizontal = vertical * this.camera.aspect;
    let distance = 0;
    for (let i = 0; i < 8; ++i) {
      const { min, max } = this.bounds;
      const corner = new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z).sub(centre);
      const needed = Math.max(Math.abs(corner.dot(right)) / horizontal, Math.abs(corner.dot(over)) / vertical);
      distance = Math.max(distance, corner.dot(direction) + needed);
    }
    return distance;
  }

  /// Turns the camera around the model, in radians.
  turn(around, over) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const right = new THREE.Vector3().crossVectors(this.camera.up, offset).normalize();
    const angle = offset.angleTo(this.camera.up);
    offset.applyAxisAngle(right, Math.min(Math.max(over, 0.02 - angle), Math.PI - 0.02 - angle));
    offset.applyAxisAngle(this.camera.up, around);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  zoom(factor) {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  viewDirection() {
    return this.camera.position.clone().sub(this.controls.target).normalize();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.draw();
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.cut.uniforms.lineWidth.value = 1.3 * this.renderer.getPixelRatio();
      this.renderer.render(this.scene, this.camera);
      document.documentElement.dataset.frames = String(1 + Number(document.documentElement.dataset.frames ?? 0));
    });
  }
}
