// Grains that leave fracture surfaces: they fly with the surface, the air slows them, they sink and fade. Moved here, by
// simulated time: the server sends each grain once.
import * as THREE from 'three';

const LIFE = 1.4;     // [s]
const SLOWED = 0.25;  // time in which the air takes a grain's speed down to a third [s]
const SINK = 0.7;     // speed of what hangs in the air [m/s]
const SPREAD = 0.25;  // how far grains drift apart [m]
const SIZE = 0.28;    // of a grain's puff [m]
const MOST = 4000;    // grains; the oldest go first

// A puff: white, fading outwards.
function puff() {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 32;
  const context = canvas.getContext('2d');
  const fade = context.createRadialGradient(16, 16, 0, 16, 16, 16);
  fade.addColorStop(0, 'rgba(255, 255, 255, 1)');
  fade.addColorStop(1, 'rgba(255, 255, 255, 0)');
  context.fillStyle = fade;
  context.fillRect(0, 0, 32, 32);
  return new THREE.CanvasTexture(canvas);
}

export class Dust {
  constructor(scene) {
    this.grains = [];
    this.time = 0;
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * MOST), 3).setUsage(THREE.DynamicDrawUsage));
    this.geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(4 * MOST), 4).setUsage(THREE.DynamicDrawUsage));
    this.geometry.setDrawRange(0, 0);
    this.points = new THREE.Points(this.geometry,
      new THREE.PointsMaterial({ size: SIZE, map: puff(), vertexColors: true, transparent: true, depthWrite: false }));
    this.points.frustumCulled = false;
    scene.add(this.points);
  }

  // particles: x y z vx vy vz each. colour: of the body they come from.
  add(particles, time, colour) {
    for (let i = 0; i + 6 <= particles.length; i += 6) {
      const drift = new THREE.Vector3().randomDirection().multiplyScalar(SPREAD * Math.random()).toArray();
      this.grains.push({ from: particles.slice(i, i + 3), speed: particles.slice(i + 3, i + 6), drift, born: time, colour });
    }
    this.grains.splice(0, Math.max(0, this.grains.length - MOST));
  }

  // To simulated time [s].
  advance(time) {
    if (time < this.time) this.grains = [];  // another world
    this.time = time;
    this.grains = this.grains.filter((grain) => time - grain.born < LIFE);  // some are of a step whose frame is to come
    const { position, color } = this.geometry.attributes;
    this.grains.forEach((grain, i) => {
      const age = Math.max(0, time - grain.born), flown = SLOWED * (1 - Math.exp(-age / SLOWED));
      const spread = Math.sqrt(age / LIFE), sunk = SINK * (age - flown);
      const at = (axis) => grain.from[axis] + flown * grain.speed[axis] + spread * grain.drift[axis];
      position.setXYZ(i, at(0), at(1) - sunk, at(2));
      color.setXYZW(i, ...grain.colour, 0.3 * (1 - age / LIFE));
    });
    position.needsUpdate = color.needsUpdate = true;
    this.geometry.setDrawRange(0, this.grains.length);
  }
}
