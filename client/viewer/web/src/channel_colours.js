// Colours of what a body's values say: one a channel, the first is red. crumple-lab's pictures have the same
// (server/lab/scene_picture.cpp).
import * as THREE from 'three';

const FULL = [[0.80, 0.04, 0.02], [0.03, 0.16, 0.75], [0.05, 0.50, 0.08], [0.90, 0.55, 0.02],
  [0.50, 0.03, 0.55], [0.02, 0.55, 0.60], [0.90, 0.20, 0.01], [0.25, 0.10, 0.03]];  // linear RGB
const UNDENTED = [0.4, 0.4, 0.4];  // of an example-based body's rest pose

export const channelColour = (channel) => FULL[channel % FULL.length];

// Writes a colour a vertex to `out` (r g b r ...). values: one a vertex for each channel, channel after channel; with all of
// them 0 a vertex has the body's own colour, or grey if the body is example-based.
export function blend(body, values, out) {
  const vertices = out.length / 3, channels = Math.floor(values.length / vertices);
  const rest = body.model === 'example_based' ? UNDENTED : body.colour;
  for (let v = 0; v < vertices; ++v) {
    for (let k = 0; k < 3; ++k) {
      let colour = rest[k];
      for (let c = 0; c < channels; ++c) colour += values[c * vertices + v] * (channelColour(c)[k] - rest[k]);
      out[3 * v + k] = colour;
    }
  }
}

// What the colours stand for: for each list of channels, once, [{name, colour}, ...].
export function legendOf(bodies) {
  const lists = new Map(bodies.filter((body) => body.channels.length).map((body) => [body.channels.join('\n'), body.channels]));
  return [...lists.values()].map((names) => names.map((name, c) =>
    ({ name, colour: `#${new THREE.Color().setRGB(...channelColour(c)).getHexString()}` })));
}
