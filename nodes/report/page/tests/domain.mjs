// A DDS domain for one test, that no other test on this machine has at the same time: tests/free-domain
// for Node.js.

import { createSocket } from "node:dgram";
import { once } from "node:events";

// See there.
const DOMAINS = 70;
const PARTICIPANTS = 120;
// RTPS 2.5, section 9.6.2.3.
const discoveryPort = (domain, participant) => 7400 + 250 * domain + 10 + 2 * participant;

/** A socket on a port of this machine; null where somebody has it. */
async function bound(port) {
  const socket = createSocket("udp4");
  try {
    socket.bind(port, "127.0.0.1");
    await once(socket, "listening");
    return socket;
  } catch {
    socket.close();
    return null;
  }
}

/** A domain, and the socket that holds it until it is closed: that of the domain's last port, which no participant comes to. */
export async function freeDomain() {
  for (let turn = 0; turn < DOMAINS; turn += 1) {
    const domain = 1 + ((process.pid + turn) % DOMAINS);
    const guard = await bound(discoveryPort(domain, PARTICIPANTS - 1) + 1);
    if (!guard) continue;
    const sockets = await Promise.all(Array.from({ length: PARTICIPANTS }, (_, participant) => bound(discoveryPort(domain, participant))));
    sockets.forEach((socket) => socket?.close());
    if (sockets.every(Boolean)) return { domain, guard };
    guard.close();
  }
  throw new Error("no domain is free");
}
