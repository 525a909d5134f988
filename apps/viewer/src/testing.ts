// Modules of the viewer that tests/viewer uses without a page.
export {decodeMessage} from './protocol/message.js';
export {encodeMessage} from './protocol/header.js';
export {ProtocolError} from './protocol/bytes.js';
export * from './protocol/client_messages.js';
export * from './protocol/image.js';
export * from './protocol/plan_message.js';
export * from './ui/train.js';
export * from './ultrasound/geometry.js';
export {FrameAssembler} from './protocol/assembler.js';
export {RecordingReader} from './protocol/recording.js';
export {crc32} from './protocol/crc32.js';
export {Session} from './model/session.js';
export {Player} from './transport/player.js';
export {linearWeights} from './scene/interpolation.js';
export {outline, signedDistance} from './scene/outline.js';
export {PointGrid} from './scene/point_grid.js';
