// The WebSocket to crumple-viewer. Text messages are JSON both ways; binary messages are topologies and frames as the
// frame codec writes them, not compressed.
import { decode } from './frame_codec.js';

export class Connection {
  // handlers: {opened(), topology(t), frame(f), status(s), event(e), error(e), closed()}
  constructor(handlers) {
    this.handlers = handlers;
    this.open();
  }

  open() {
    const address = new URL('stream', window.location.href);
    address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
    this.socket = new WebSocket(address);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = (message) => this.receive(message.data);
    this.socket.onopen = () => this.handlers.opened();
    this.socket.onclose = () => {
      this.handlers.closed();
      setTimeout(() => this.open(), 1000);
    };
  }

  receive(data) {
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      if (message.type in this.handlers) this.handlers[message.type](message);
      return;
    }
    const message = decode(data);
    this.handlers[message.kind](message);
  }

  // The next frame may come. A page that draws slowly asks late, and sees fewer frames, never older ones.
  grantCredit() {
    this.send({ type: 'credit' });
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}
