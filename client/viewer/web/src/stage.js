// What is drawn: a three.js scene with one mesh a body, fed by topologies and frames.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { blend } from './channel_colours.js';
import { Dust } from './dust.js';

const MATT = { metalness: 0, roughness: 0.75 };  // of what shows values

export class Stage {
  constructor(canvas) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true, powerPreference: 'high-performance' });
    // A processor that draws by itself gets a plainer picture, so that the server keeps its share of it; unless the
    // address asks for `?fine`.
    const gl = this.renderer.getContext();
    const about = gl.getExtension('WEBGL_debug_renderer_info');
    const name = about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : '';
    this.software = /swiftshader|llvmpipe|software/i.test(name) && !new URLSearchParams(window.location.search).has('fine');
    this.renderer.setPixelRatio(this.software ? 1 : Math.min(window.devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = !this.software;
    this.changed = true;
    this.renderer.toneMapping = THREE.NeutralToneMapping;  // keeps colours that mean something
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0x9fb4c8);
    if (!this.software) {
      const pmrem = new THREE.PMREMGenerator(this.renderer);
      this.scene.environment = pmrem.fromScene(new RoomEnvironment(), 0.04).texture;
      this.scene.environmentIntensity = 0.25;
    }
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.05, 500);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => { this.changed = true; });
    this.addLights();
    this.bodies = [];
    this.dust = new Dust(this.scene);
    this.framed = false;
    this.raycaster = new THREE.Raycaster();
    window.addEventListener('resize', () => this.resize());
    this.resize();
  }

  addLights() {
    const sun = new THREE.DirectionalLight(0xfff2dd, 2.2);
    sun.position.set(8, 14, 10);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, { left: -14, right: 14, top: 14, bottom: -14, near: 1, far: 60 });
    sun.shadow.bias = -0.0005;
    sun.shadow.normalBias = 0.02;
    this.sun = sun;
    this.scene.add(sun, sun.target, new THREE.HemisphereLight(0xcfe0ff, 0x6b5f50, 0.8));
  }

  resize() {
    this.changed = true;
    this.renderer.setSize(window.innerWidth, window.innerHeight, false);
    this.camera.aspect = window.innerWidth / window.innerHeight;
    this.camera.updateProjectionMatrix();
  }

  // topology: {epoch, base, part, parts, bodies: [{id, name, model, deformable, vertices, triangles, colour, opacity, channels}]}
  // Without base the bodies are all there are, else those that changed since that epoch. Only after its last part is the epoch
  // that of the topology: until then, and after a topology that builds on one that is not here, no frame is drawn.
  setTopology(topology) {
    const follows = topology.part === 0 ? topology.base === null || topology.base === this.epoch : topology.part === this.nextPart;
    this.epoch = null;
    this.nextPart = follows ? topology.part + 1 : null;
    if (!follows) return;
    if (topology.base === null && topology.part === 0) {
      this.bodies.forEach((body) => this.removeBody(body));
      this.bodies = [];
    }
    for (const body of topology.bodies) {
      if (this.bodies[body.id]) this.removeBody(this.bodies[body.id]);
      this.bodies[body.id] = this.makeBody(body);
    }
    if (topology.part + 1 === topology.parts) this.epoch = topology.epoch;
    this.changed = true;
  }

  removeBody(body) {
    this.scene.remove(body.mesh);
    body.mesh.geometry.dispose();
    body.mesh.material.dispose();
  }

  makeBody(body) {
    const geometry = new THREE.BufferGeometry();
    const position = new THREE.BufferAttribute(new Float32Array(body.vertices), 3);
    position.setUsage(body.deformable ? THREE.DynamicDrawUsage : THREE.StaticDrawUsage);
    geometry.setAttribute('position', position);
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(body.triangles), 1));
    // Normals that never change are for shadows alone, which are looked for a little along them; without any, nowhere.
    const up = new Float32Array(body.vertices.length);
    for (let i = 1; i < up.length; i += 3) up[i] = 1;
    geometry.setAttribute('normal', new THREE.BufferAttribute(up, 3));
    const glass = body.opacity < 1;
    const metal = body.model === 'example_based';
    // Flat shading takes normals from the screen's derivatives: nothing to recompute when vertices move.
    const look = { color: new THREE.Color().setRGB(...body.colour), side: THREE.DoubleSide, flatShading: true,
      transparent: glass, opacity: body.opacity, depthWrite: !glass || body.opacity > 0.6 };
    const material = this.software ? new THREE.MeshLambertMaterial(look) : new THREE.MeshStandardMaterial({ ...look,
      metalness: metal ? 0.55 : glass ? 0.1 : 0.02, roughness: metal ? 0.42 : glass ? 0.08 : 0.85 });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.castShadow = !glass && body.triangles.length / 3 > 2;
    mesh.receiveShadow = true;
    mesh.frustumCulled = false;
    mesh.userData = { id: body.id, fixed: body.model === 'fixed' };
    this.scene.add(mesh);
    const shine = this.software ? {} : { metalness: material.metalness, roughness: material.roughness };
    return { ...body, mesh, base: material.color.clone(), shine };
  }

  // frame: {epoch, bodies: [{id, pose, positions | null, values | null}]}; frames of another epoch are not drawn.
  setFrame(frame) {
    if (frame.epoch !== this.epoch) return;
    this.changed = true;
    for (const moved of frame.bodies) {
      const body = this.bodies[moved.id];
      if (!body) continue;
      if (body.deformable) {
        if (moved.positions) {
          body.mesh.geometry.attributes.position.array.set(moved.positions);
          body.mesh.geometry.attributes.position.needsUpdate = true;
          body.mesh.geometry.boundingSphere = null;
          body.mesh.geometry.boundingBox = null;
        }
      } else {
        body.mesh.position.set(...moved.pose.position);
        body.mesh.quaternion.set(...moved.pose.quaternion);
      }
      this.setValues(body, moved.values);
    }
    this.dust.advance(frame.time);
    if (!this.framed) this.frameCamera();
  }

  // event: {body, time, particles} of a fracture.
  addDust(event) {
    const body = this.bodies[event.body];
    if (!body) return;
    const pale = body.base.clone().lerp(new THREE.Color(0.85, 0.85, 0.85), 0.5);
    this.dust.add(event.particles, event.time, [pale.r, pale.g, pale.b]);
  }

  // Colours vertices by their values, or gives the body back its own colour.
  setValues(body, values) {
    const { geometry, material } = body.mesh;
    if (!values || values.length === 0) {
      if (material.vertexColors) {
        material.vertexColors = false;
        material.color.copy(body.base);
        Object.assign(material, body.shine);
        material.needsUpdate = true;
      }
      return;
    }
    if (!geometry.attributes.color) {
      geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(geometry.attributes.position.count * 3), 3));
    }
    const colour = geometry.attributes.color;
    blend(body, values, colour.array);
    colour.needsUpdate = true;
    if (!material.vertexColors) {
      material.vertexColors = true;
      material.color.set(0xffffff);
      Object.assign(material, this.software ? {} : MATT);  // metal would mirror them away
      material.needsUpdate = true;
    }
  }

  // Looks at what may move, and down to what it would fall on, from the front and above; from the side where fixed
  // bodies hide the least of it.
  frameCamera() {
    for (const body of this.bodies) body.mesh.updateWorldMatrix(false, false);
    const loose = this.bodies.filter((body) => body.model !== 'fixed');
    const fixed = this.bodies.filter((body) => body.model === 'fixed');
    const walls = fixed.map((body) => body.mesh);
    const centres = [];
    const box = new THREE.Box3();
    for (const body of loose.length ? loose : fixed) {
      const own = new THREE.Box3().setFromObject(body.mesh);
      centres.push(own.getCenter(new THREE.Vector3()));
      box.union(own);
    }
    if (box.isEmpty()) box.set(new THREE.Vector3(-2, 0, -2), new THREE.Vector3(2, 2, 2));
    const down = new THREE.Raycaster(box.getCenter(new THREE.Vector3()), new THREE.Vector3(0, -1, 0), 0, 20);
    const under = down.intersectObjects(walls, false);
    if (under.length) box.min.y = Math.min(box.min.y, under.at(-1).point.y);

    const centre = box.getCenter(new THREE.Vector3());
    const distance = 2.4 * Math.max(1.2, 0.5 * box.getSize(new THREE.Vector3()).length());
    let best = { hidden: Infinity };
    for (const turn of [0, -0.5, 0.5, -1, 1, -1.6, 1.6, -2.2, 2.2, 3.14]) {
      const from = new THREE.Vector3(0.75, 0.5, 1).normalize().multiplyScalar(distance)
        .applyAxisAngle(new THREE.Vector3(0, 1, 0), turn).add(centre);
      const hidden = [...centres, centre].filter((point) => {
        const way = point.clone().sub(from);
        const sight = new THREE.Raycaster(from, way.clone().normalize(), 0, 0.98 * way.length());
        return sight.intersectObjects(walls, false).length > 0;
      }).length;
      if (hidden < best.hidden) best = { hidden, from };
    }
    this.look(best.from, centre);
  }

  // Puts the eye at `from` and what it looks at, where shadows are sharpest, in the middle of the picture [m].
  look(from, centre) {
    this.framed = true;
    this.changed = true;
    this.camera.position.copy(from);
    this.controls.target.copy(centre);
    this.controls.update();
    const reach = Math.max(14, 0.8 * this.camera.position.distanceTo(this.controls.target));
    this.sun.target.position.copy(centre);
    // From over the eye's left shoulder: what is seen is lit, and shadows fall to the right.
    const back = from.clone().sub(centre).setY(0).normalize();
    const light = back.clone().applyAxisAngle(new THREE.Vector3(0, 1, 0), -0.7).multiplyScalar(13).setY(14);
    this.sun.position.copy(centre).addScaledVector(light, reach / 14);
    Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 1, far: 4.3 * reach });
    this.sun.shadow.camera.updateProjectionMatrix();
    this.camera.near = reach / 280;
    this.camera.far = 40 * reach;
    this.camera.updateProjectionMatrix();
  }

  // The body under the pointer: {id, point, direction} with the direction of sight, or null. Fixed bodies do not count.
  pick(clientX, clientY) {
    const pointer = new THREE.Vector2(2 * clientX / window.innerWidth - 1, 1 - 2 * clientY / window.innerHeight);
    this.raycaster.setFromCamera(pointer, this.camera);
    const hits = this.raycaster.intersectObjects(this.bodies.map((b) => b.mesh).filter((m) => !m.userData.fixed), false);
    if (hits.length === 0) return null;
    return { id: hits[0].object.userData.id, point: hits[0].point.toArray(),
      direction: this.raycaster.ray.direction.toArray() };
  }

  // Draws if anything moved.
  render() {
    if (!this.changed) return;
    this.changed = false;
    this.renderer.render(this.scene, this.camera);
  }
}
