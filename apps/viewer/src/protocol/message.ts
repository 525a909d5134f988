// One message of any type that this viewer reads.
import {ProtocolError} from './bytes.js';
import {decodeContour, type Contour} from './contour.js';
import {decodeFrame, type Frame} from './frame.js';
import {HEADER_BYTES, MessageType, decodeHeader, type Header} from './header.js';
import {decodeImage, decodeScanner, type Scanner, type UltrasoundImage} from './image.js';
import {decodePlan, type Plan} from './plan_message.js';
import {decodeScene, type SceneMessage} from './scene_message.js';
import {decodeDose, decodeError, decodeEvent, decodeForce, decodePing, decodeState, decodeWelcome} from './server_messages.js';
import type {Dose, HandForce, Ping, ServerError, ServerEvent, State, Welcome} from './server_messages.js';
import {decodeTopology, type Topology} from './topology.js';

export type Message =
  | {kind: 'welcome'; header: Header; body: Welcome}
  | {kind: 'topology'; header: Header; body: Topology}
  | {kind: 'frame'; header: Header; body: Frame}
  | {kind: 'state'; header: Header; body: State}
  | {kind: 'event'; header: Header; body: ServerEvent}
  | {kind: 'error'; header: Header; body: ServerError}
  | {kind: 'ping'; header: Header; body: Ping}
  | {kind: 'force'; header: Header; body: HandForce}
  | {kind: 'dose'; header: Header; body: Dose}
  | {kind: 'scene'; header: Header; body: SceneMessage}
  | {kind: 'plan'; header: Header; body: Plan}
  | {kind: 'image'; header: Header; body: UltrasoundImage}
  | {kind: 'scanner'; header: Header; body: Scanner}
  | {kind: 'contour'; header: Header; body: Contour}
  | {kind: 'other'; header: Header};

/** `bytes` is a whole message. A message of a type not known here, of a later version say, is `other`. */
export function decodeMessage(bytes: Uint8Array): Message {
  if (bytes.length < HEADER_BYTES) throw new ProtocolError('a message is shorter than its header');
  const header = decodeHeader(bytes);
  if (bytes.length !== HEADER_BYTES + header.length) throw new ProtocolError('a message is not as long as its header says');
  const body = bytes.subarray(HEADER_BYTES);
  switch (header.type) {
    case MessageType.Welcome: return {kind: 'welcome', header, body: decodeWelcome(body)};
    case MessageType.Topology: return {kind: 'topology', header, body: decodeTopology(body)};
    case MessageType.Frame: return {kind: 'frame', header, body: decodeFrame(body)};
    case MessageType.State: return {kind: 'state', header, body: decodeState(body)};
    case MessageType.Event: return {kind: 'event', header, body: decodeEvent(body)};
    case MessageType.Error: return {kind: 'error', header, body: decodeError(body)};
    case MessageType.Ping: return {kind: 'ping', header, body: decodePing(body)};
    case MessageType.Force: return {kind: 'force', header, body: decodeForce(body)};
    case MessageType.Dose: return {kind: 'dose', header, body: decodeDose(body)};
    case MessageType.Scene: return {kind: 'scene', header, body: decodeScene(body)};
    case MessageType.Plan: return {kind: 'plan', header, body: decodePlan(body)};
    case MessageType.Image: return {kind: 'image', header, body: decodeImage(body)};
    case MessageType.Scanner: return {kind: 'scanner', header, body: decodeScanner(body)};
    case MessageType.Contour: return {kind: 'contour', header, body: decodeContour(body)};
    default: return {kind: 'other', header};
  }
}
