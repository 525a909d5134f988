"""Conversations with a scripted server: the golden messages of net/PROTOCOL.md, what later versions may send, what is
broken, and how connections end. A check is what the code between two calls of verdicts.begin() asks for."""
import copy
import struct

from judge import ERRORS, SCHEMA, Client, Listener, mesh_of, require

EXAMPLES = SCHEMA.all["examples"]
REST = EXAMPLES["TOPOLOGY"]["body"]["rest_positions"]
TOKEN = "e0e1e2e3e4e5e6e7e8e9eaebecedeeeff0f1f2f3f4f5f6f7f8f9fafbfcfdfeff"
ROLES = SCHEMA.all["enums"]["Role"]["values"]
NOT_POSSIBLE = 999  # a number that no version of this document has
LATCHED = SCHEMA.all["flags"]["ForceFlag"]["values"]["LATCHED"]
MOST_POSES = 50  # a second, that the judge's WELCOME allows a device


def changed(name, **values):
    """Body and sections of an example with other values."""
    of = copy.deepcopy(EXAMPLES[name])
    return of["body"] | values, of.get("sections", {})


def welcome(role):
    """WELCOME: of a device the example's, with its needle 2, but few poses a second."""
    body, sections = changed("WELCOME", role=ROLES[role], max_poses_per_s=MOST_POSES)
    if role != "DEVICE":
        sections = {"DEVICE": {"needle": 0xFFFF, "needle_count": 3}}
    return body, sections


def full_frame(tick, positions, snapshot=8):
    """A FULL frame with the seed that the example's FRAME says fell before."""
    body, sections = changed("FRAME", tick=tick, base_tick=0, frame_flags=1, snapshot_sequence=snapshot,
                             ranges=[{"first": 0, "count": len(positions)}], positions=positions)
    first = sections["SEEDS"]["entries"][0] | {"id": 1}
    return body, {"SEEDS": {"seed_count": 1, "entries": [first]}}


def body_bytes(name, body, sections=None):
    return SCHEMA.encode(name, body, sections)[32:]


def at(positions, *changes):
    positions = copy.deepcopy(positions)
    for index, point in changes:
        positions[index] = point
    return positions


AFTER_EXAMPLE = at(REST, (1, [10, 0.5, -0.25]), (3, [0, 0, 9]))


def begin_mesh(peer):
    """WELCOME, TOPOLOGY and the first FRAME of tick 41, of a viewer."""
    peer.send("WELCOME", *welcome("VIEWER"))
    peer.put(peer.example("TOPOLOGY"))
    peer.send("FRAME", *full_frame(41, REST))


def is_frame(tick, positions):
    return lambda frame: frame["tick"] == tick and frame["mesh"] == mesh_of(positions)


def documented_messages(v, command):
    """A viewer with a token, and every message that the document shows."""
    with Listener() as listener, Client(command, listener.port, "viewer", TOKEN) as client:
        peer = listener.accept()
        v.begin("hello first", "The client connects and sends HELLO first, within 2 s.")
        name, header, body, sections = peer.take() or ("nothing", {}, {}, {})
        require(name == "HELLO" and header["sequence"] == 1, f"the first message is {name}")
        v.begin("role", "Client → server, first message: identity, role and subscriptions.")
        require(body["role"] == ROLES["VIEWER"], f"role {body['role']} of a viewer")
        require(len(body["name"].encode("utf-8")) <= 64, "a name of more than 64 bytes")
        v.begin("token", "2 TOKEN, 32 bytes: the token itself, see [Access](#access).")
        require(sections.get("TOKEN", {}).get("token") == TOKEN, f"sections {sections}")
        v.begin("welcome", "The server answers WELCOME, or a fatal ERROR.")
        peer.send("WELCOME", *welcome("VIEWER"))
        client.wait("welcome", lambda w: w["role"] == ROLES["VIEWER"] and w["needle"] == 0xFFFF and
                    w["server"] == "brachyd 0.1.0")
        v.begin("topology", "Server → client, once after WELCOME: the points at rest and the surface's triangles.")
        peer.put(peer.example("TOPOLOGY"))
        client.wait("topology", lambda t: t == {"hash": "2f2673dd4fb1cdb3", "points": 5, "triangles": 4})
        v.begin("full frame",
                "It replaces the mesh and all seeds; any other FRAME needs a mesh at `base_tick` or later of the "
                "same run, and a client without one connects again.")
        moved = at(REST, (4, [2.25, 2.5, 3]))
        peer.send("FRAME", *full_frame(41, moved))
        client.wait("frame", is_frame(41, moved))
        v.begin("changes", "The ranges hold every point that changed after base_tick: apply to a mesh that stands at "
                "base_tick or later, refuse otherwise")
        peer.put(peer.example("FRAME"))
        client.wait("frame", is_frame(42, at(AFTER_EXAMPLE, (4, [2.25, 2.5, 3]))))
        v.begin("event", "Server → client: something happened once.")
        peer.put(peer.example("EVENT"))
        client.wait("event", lambda e: e == {"kind": 3, "text": "capsule punctured"})
        v.begin("error that is not fatal",
                "Go by `fatal`, not by the code: a later version may send a code in either way.")
        for code in (ERRORS["TIMEOUT"], NOT_POSSIBLE):
            peer.send("ERROR", changed("ERROR", code=code, text=f"of code {code}")[0])
            client.wait("error", lambda e, c=code: e == {"code": c, "fatal": 0, "text": f"of code {c}"})
        v.begin("every other message",
                "STATE, EVENT, ERROR and PING may come at any time after WELCOME, and so may FORCE and LOCAL_MODEL "
                "to a device, and DOSE to clients subscribed to the mesh")
        for name in ("STATE", "ERROR", "DOSE", "DOSE_PLANNED", "SCENE", "IMAGE", "SCANNER", "PLAN", "CONTOUR"):
            peer.put(peer.example(name))
        ping_is_answered(v, peer)
        later_versions(v, peer, client)
        v.begin("reset",
                "RESET ([CONTROL](#15-control)) restarts the simulation from scratch: ticks count from 1 again, "
                "seeds are gone but those that were there at the start (scene key `implant.seeds`), and the next "
                "FRAME is FULL, with an earlier tick than the last one's.")
        peer.send("FRAME", *full_frame(3, REST, snapshot=20))
        client.wait("frame", is_frame(3, REST))
        v.begin("server leaves", "A client that ends its sending side has left.")
        peer.close()
        client.finish()


def ping_is_answered(v, peer):
    v.begin("ping", "A request is answered at once with the same nonce.")
    peer.send("PING", {"nonce": 4711, "reply": 0, "echoed_stamp_ns": 0, "received_ns": 0})
    asked = peer.stamp
    _, header, body, _ = peer.wait("PING", lambda entry: entry[2]["reply"] == 1)
    require(body["nonce"] == 4711 and body["echoed_stamp_ns"] == asked, f"the answer is {body}")
    require(0 < body["received_ns"] <= header["stamp_ns"], "received_ns is not between 0 and the answer's own stamp")


def later_versions(v, peer, client):
    v.begin("unknown message",
            "Skip messages of unknown type (their sequence counts), sections of unknown id, unknown flag bits, "
            "unknown event kinds and error codes (show their text).")
    peer.put(peer.raw(NOT_POSSIBLE, b"\xff" * 70))
    peer.send("EVENT", changed("EVENT", text="after an unknown message")[0])
    client.wait("event", lambda e: e["text"] == "after an unknown message")
    v.begin("unknown section", "Lists of sections end HELLO, WELCOME, TOPOLOGY, FRAME and STATE")
    positions = at(AFTER_EXAMPLE, (0, [0.5, 0, 0]))
    body = body_bytes("FRAME", *full_frame(43, positions))
    without = len(body_bytes("FRAME", *full_frame(43, positions))) - len(
        b"".join(piece[2] for piece in SCHEMA.section_pieces("FRAME", full_frame(43, positions)[1])))
    count, = struct.unpack_from("<H", body, without)
    unknown = struct.pack("<HHI", NOT_POSSIBLE, 0, 5) + b"later"
    peer.put(peer.raw(4, body[:without] + struct.pack("<H", count + 1) + body[without + 2:] + unknown))
    client.wait("frame", is_frame(43, positions))
    v.begin("unknown flags", "Reserved fields: send 0, ignore.")
    body, sections = full_frame(44, REST)
    body["step_flags"] = 0xF0000000
    reserved = bytearray(body_bytes("FRAME", body, sections))
    struct.pack_into("<H", reserved, 106, 0xFFFF)
    peer.put(peer.raw(4, bytes(reserved), flags=0x80000001))
    client.wait("frame", is_frame(44, REST))
    v.begin("unknown event", "of unknown id, unknown flag bits, unknown event kinds and error codes (show their text).")
    peer.send("EVENT", changed("EVENT", kind=NOT_POSSIBLE, text="a \"later\" kind \\ größer")[0])
    client.wait("event", lambda e: e == {"kind": NOT_POSSIBLE, "text": "a \"later\" kind \\ größer"})


def pieces_of_any_size(v, command):
    """Single bytes, and many messages at once; then a fatal ERROR."""
    with Listener() as listener, Client(command, listener.port, "viewer") as client:
        peer = listener.accept()
        peer.wait("HELLO")
        v.begin("single bytes", "A byte stream of messages in both directions over TCP")
        body, sections = welcome("VIEWER")
        stream = peer.bytes_of("WELCOME", body, sections) + peer.example("TOPOLOGY")
        stream += peer.bytes_of("FRAME", *full_frame(41, REST)) + peer.example("FRAME")
        for i in range(len(stream)):
            peer.put(stream[i:i + 1])
        client.wait("frame", is_frame(42, AFTER_EXAMPLE))
        v.begin("many at once",
                "it reads all that has arrived, applies **every** FRAME in order, since each holds changes, and "
                "draws the last.")
        stream, positions = b"", AFTER_EXAMPLE
        for tick in range(43, 143):
            positions = at(positions, (tick % 5, [tick / 8, -tick / 4, 1]))
            body, sections = changed("FRAME", tick=tick, base_tick=tick - 1, snapshot_sequence=tick,
                                     ranges=[{"first": tick % 5, "count": 1}], positions=[positions[tick % 5]])
            sections["SEEDS"] = {"seed_count": 2, "entries": []}
            stream += peer.bytes_of("FRAME", body, sections)
        peer.put(stream)
        client.wait("frame", is_frame(142, positions))
        v.begin("fatal error",
                "The server first sends an ERROR with `fatal` = 1 and the reason, then ends its side of the stream, "
                "and closes at most 0.5 s later. After a fatal ERROR nothing follows.")
        peer.send("ERROR", changed("ERROR", code=NOT_POSSIBLE, fatal=1, text="the licence ran out")[0])
        client.wait("error", lambda e: e == {"code": NOT_POSSIBLE, "fatal": 1, "text": "the licence ran out"})
        peer.close()
        client.finish()


def refused(v, command):
    """A fatal ERROR in place of WELCOME."""
    with Listener() as listener, Client(command, listener.port, "viewer") as client:
        peer = listener.accept()
        peer.wait("HELLO")
        v.begin("refused with a reason",
                "answered with ERROR UNAUTHORISED (fatal), whose text says which of the three, after 0.2 s where a "
                "token was sent")
        peer.send("ERROR", changed("ERROR", code=ERRORS["UNAUTHORISED"], fatal=1, text="a token is required")[0])
        client.wait("error", lambda e: e == {"code": ERRORS["UNAUTHORISED"], "fatal": 1, "text": "a token is required"})
        peer.close()
        client.finish()


BREAKS = "The receiver of a message that breaks these rules closes the connection."
SEQUENCE = "per connection and direction 1, 2, 3, … over all messages; anything else is a protocol error"
WHOLE = "A body with bytes missing or left over is a protocol error."
REFUSE = "apply to a mesh that stands at base_tick or later, refuse otherwise"


def broken(v, command):
    """Each of what is no protocol, to a viewer of its own, which is to close the connection."""
    frame, frame_sections = changed("FRAME")
    whole = body_bytes("FRAME", frame, frame_sections)
    last = len(whole) - 12  # of the section LAG: header and 4 bytes
    event = changed("EVENT")[0]
    text = body_bytes("EVENT", event)
    other = "0x0123456789abcdef"

    def raw(*arguments, **named):
        return lambda peer: peer.raw(*arguments, **named)

    cases = [
        ("gap in the sequence", SEQUENCE, raw(4, whole, skipped=1)),
        ("magic", BREAKS, raw(4, whole, magic=b"BRCX")),
        ("garbage", BREAKS, lambda peer: b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n"),
        ("body with a byte missing", WHOLE, raw(4, whole[:-1])),
        ("body with a byte left over", WHOLE, raw(4, whole + b"\0")),
        ("section beyond its body", WHOLE, raw(4, whole[:last + 4] + struct.pack("<I", 5) + whole[last + 8:])),
        ("stale mesh", REFUSE, raw(4, body_bytes("FRAME", frame | {"tick": 60, "base_tick": 50}, frame_sections))),
        ("other topology", "whose points these are",
         raw(4, body_bytes("FRAME", frame | {"topology_hash": other}, frame_sections))),
        ("range outside the mesh", "points [first, first + count), count ≥ 1, ascending, disjoint, within N",
         raw(4, body_bytes("FRAME", frame | {"ranges": [{"first": 4, "count": 2}]}, frame_sections))),
        ("text that is no UTF-8", "UTF-8, well-formed and without control characters",
         raw(7, text.replace(b"capsule", b"caps\xff\xfee"))),
        ("message that only a client may send",
         "HELLO a second time, or a message only the other side may send, is a protocol error.",
         raw(5, body_bytes("POSE", changed("POSE")[0]))),
    ]
    for name, sentence, message in cases:
        with Listener() as listener, Client(command, listener.port, "viewer") as client:
            peer = listener.accept()
            peer.wait("HELLO")
            begin_mesh(peer)
            client.wait("frame", is_frame(41, REST))
            v.begin(name, sentence)
            peer.put(message(peer))
            peer.wait_for_end()
            client.finish()
            require(len([key for key, _ in client.lines if key == "frame"]) == 1, "the message was shown")
    with Listener() as listener, Client(command, listener.port, "viewer") as client:
        peer = listener.accept()
        peer.wait("HELLO")
        v.begin("another version", "Another one is answered with ERROR VERSION and the end")
        body, sections = welcome("VIEWER")
        peer.put(peer.raw(2, body_bytes("WELCOME", body, sections), version=2))
        peer.wait_for_end()
        client.finish()


def device(v, command):
    """A device whose tracker loses the needle now and then, at a server that takes few poses."""
    with Listener() as listener, Client(command, listener.port, "device") as client:
        peer = listener.accept()
        v.begin("device", "1 viewer, 2 device (may send POSE)")
        _, _, body, _ = peer.wait("HELLO")
        require(body["role"] == ROLES["DEVICE"], f"role {body['role']} of a device")
        peer.send("WELCOME", *welcome("DEVICE"))
        client.wait("welcome", lambda w: w["needle"] == 2)
        v.begin("needle", "the device's own, as WELCOME says; another is refused")
        depths = []
        poses = []
        while not depths or depths[-1] < -30 + 0.25 * 65:  # past two of the tracker's losses
            poses.append(peer.wait("POSE"))
            depths.append(poses[-1][2]["X_WN"][2][3])
            require(poses[-1][2]["needle"] == 2, f"a pose of needle {poses[-1][2]['needle']}")
            require(poses[-1][2]["flags"] == 0, "a reserved field that is not 0")
        v.begin("no pose while tracking is lost", "send nothing while tracking is lost")
        expected = [-30 + 0.25 * k for k in range(len(depths) + 4) if k % 50 not in (10, 11)][:len(depths)]
        for (_, _, pose, _), depth in zip(poses, expected):
            require(pose["X_WN"] == [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, depth]],
                     f"the pose {pose['X_WN']} where the tracker's was at depth {depth}")
        v.begin("stamps", "stamp or sequence not above those of the last accepted pose")
        stamps = [header["stamp_ns"] for _, header, _, _ in poses]
        require(all(a < b for a, b in zip(stamps, stamps[1:])), "stamps of poses do not ascend")
        v.begin("pose rate", "Poses: `max_poses_per_s`, with bursts of a tenth of that; more are refused and counted")
        allowed, last = MOST_POSES / 10, stamps[0]
        for stamp in stamps:
            allowed = min(allowed + (stamp - last) * 1e-9 * MOST_POSES, MOST_POSES / 10) - 1
            last = stamp
            require(allowed > -1, f"more than {MOST_POSES} poses a second, by their stamps")
        v.begin("force",
                "Server → client (role device), at the lesser of `rate_hz` and 1000 Hz: what the hand is to get.")
        peer.put(peer.example("FORCE"))
        client.wait("force", lambda f: f == {"input_stamp_ns": 1000000500, "force_n": [0.5, -0.25, 2]})
        v.begin("local model to a device that renders FORCE",
                "LOCAL_MODEL to a device, and DOSE to clients subscribed to the mesh")
        peer.put(peer.example("LOCAL_MODEL"))
        ping_is_answered(v, peer)
        v.begin("pose refused",
                "A pose that is not finite, not rigid, stale or back in time is refused by the daemon: ERROR "
                "POSE_REFUSED, at most 4 a second, and always counted in STATE.")
        peer.put(peer.example("ERROR"))
        client.wait("error", lambda e: e == {"code": 7, "fatal": 0, "text": "not rigid"})
        v.begin("arm", "latches the needle: its force goes to 0, and returns (over 0.5 s again) only after ARM.")
        peer.send("FORCE", changed("FORCE", flags=LATCHED, force_n=[0, 0, 0])[0])
        _, _, body, _ = peer.wait("ARM")
        require(body["needle"] == 2, f"an ARM of needle {body['needle']}")
        v.begin("lease lost",
                "the first client with the role device whose HELLO asks for that needle (or for any, while it is "
                "free), until it disconnects.")
        peer.send("ERROR", changed("ERROR", code=ERRORS["TIMEOUT"], fatal=1, text="nothing was read")[0])
        client.wait("error", lambda e: e == {"code": ERRORS["TIMEOUT"], "fatal": 1, "text": "nothing was read"})
        peer.close()
        client.finish()
    for name, code in (("device is busy", "DEVICE_BUSY"), ("needle does not exist", "NO_NEEDLE")):
        with Listener() as listener, Client(command, listener.port, "device") as client:
            peer = listener.accept()
            peer.wait("HELLO")
            v.begin(name, "Others get DEVICE_BUSY with the holder's name, address and how long it has held it, and are "
                    "closed; a request for a needle that does not exist gets NO_NEEDLE.")
            peer.send("ERROR", changed("ERROR", code=ERRORS[code], fatal=1, text="held by touch")[0])
            client.wait("error", lambda e, c=code: e == {"code": ERRORS[c], "fatal": 1, "text": "held by touch"})
            peer.close()
            client.finish()
            require(not [entry for entry in peer.seen if entry[0] == "POSE"], "it sent poses without WELCOME")


def force_that_is_no_number(v, command):
    with Listener() as listener, Client(command, listener.port, "device") as client:
        peer = listener.accept()
        peer.wait("HELLO")
        peer.send("WELCOME", *welcome("DEVICE"))
        client.wait("welcome")
        v.begin("force that is no number", "A number that is not finite is a protocol error.")
        peer.send("FORCE", changed("FORCE", force_n=[0, "nan", 0])[0])
        peer.wait_for_end()
        client.finish()
        require(not [key for key, _ in client.lines if key == "force"], "the force was shown")


ALL = [documented_messages, pieces_of_any_size, refused, broken, device, force_that_is_no_number]
