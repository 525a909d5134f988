#ifndef BRACHYD_CLIENT_H
#define BRACHYD_CLIENT_H

/* The client of brachyd's native protocol in C99: a viewer, a device or an operator. Link with
 * `pkg-config --libs brachyd-client`. net/c_api/README.md has a program; net/PROTOCOL.md has what each number means.
 *
 * Units and frames: mm, s, N; points, axes and forces are in the world frame W, patient RAS (+x the patient's right,
 * +y anterior, +z superior). A pose is X_WN, needle to world, as the 3×4 matrix [R | p] row by row; the needle's origin
 * is its tip, and its +z runs along the shaft towards the tip. Times that end in `_ns` are of a monotonic clock; of
 * which machine's is said beside each.
 *
 * Threads: the library starts none and calls back nobody. All functions that take a handle are for one thread at a
 * time; two handles are independent.
 *
 * Errors: a function that can fail returns kBrachydOk, or a status below 0; brachyd_error_text() then says what was
 * wrong and what helps. No exception leaves the library. A handle that is NULL is kBrachydBadArgument.
 *
 * Versions: within a soname no struct, number or function changes; what a later version adds are functions, and
 * members at the end of BrachydOptions, which has its size in it. */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define BRACHYD_API __attribute__((visibility("default")))
#else
#define BRACHYD_API
#endif

/** What a function returns. brachyd_status_text() has each in words. */
enum BrachydStatus {
  kBrachydOk = 0,
  kBrachydBadArgument = -1, /**< NULL, a number that is not finite, an option out of its range */
  kBrachydUnreachable = -2, /**< nobody listens there, or nobody answered in time */
  kBrachydRefused = -3, /**< the server ended the connection by an ERROR: brachyd_next_error() has its code */
  kBrachydClosed = -4,  /**< there is no connection, or it ended */
  kBrachydNothing = -5, /**< what was asked for has not come yet */
  kBrachydInternal = -6 /**< no memory, or a defect of this library */
};

/** BrachydOptions::role and BrachydWelcome::role. */
enum BrachydRole {
  kBrachydViewer = 1,
  kBrachydDevice = 2,  /**< moves a needle and gets its force */
  kBrachydOperator = 3 /**< a viewer that may also control the simulation */
};

/** Bits of BrachydOptions::subscription. */
enum BrachydSubscription {
  kBrachydFullFrames =
      1 << 0,               /**< every snapshot has all points on the wire; what a program sees is the same */
  kBrachydSurface = 1 << 2, /**< the mesh is the surface's points alone */
  kBrachydNoMesh = 1 << 3,  /**< no mesh: of a device on a slow link, whose forces a mesh would hold up */
  kBrachydUltrasound = 1 << 5 /**< images, where the server has ultrasound */
};

/** What brachyd_poll() returns: bits of what came. */
enum BrachydNews {
  kBrachydNewTopology = 1 << 0,
  kBrachydNewFrame = 1 << 1,
  kBrachydNewForce = 1 << 2,
  kBrachydNewState = 1 << 3,
  kBrachydNewEvent = 1 << 4,
  kBrachydNewError = 1 << 5,
  kBrachydNewImage = 1 << 6,
  kBrachydNewScanner = 1 << 7
};

/** BrachydNeedle::contact. */
enum BrachydContact {
  kBrachydFree = 0,
  kBrachydTouching = 1,
  kBrachydInserted = 2,
  kBrachydThrough = 3, /**< the tip came out of the far side */
  kBrachydWithdrawn = 4
};

/** Bits of BrachydForce::flags. */
enum BrachydForceFlag {
  kBrachydForceArmed = 1 << 0,   /**< the force may be rendered */
  kBrachydForceRamping = 1 << 1, /**< it comes in, or is limited by its slew limit */
  kBrachydForceLatched = 1 << 2, /**< a fault: no force until brachyd_arm() */
  kBrachydForceLimited = 1 << 3, /**< scaled to the device's largest, or a stiffness was cut */
  kBrachydForceExpired = 1 << 4  /**< what it rests on is too old: it goes to 0 */
};

/** Action of brachyd_control(). */
enum BrachydAction {
  kBrachydPlay = 1,  /**< the daemon's scripted needle starts at its beginning */
  kBrachydStop = 2,  /**< … and is removed */
  kBrachydReset = 3, /**< tissue, needles and seeds from scratch */
  kBrachydModel = 4  /**< another kernel of the tissue's model */
};

/** Which array of the ultrasound probe. */
enum BrachydArray {
  kBrachydAnyArray = 0, /**< in brachyd_get_image(): the newest of any; in BrachydScanner: as it is */
  kBrachydTransverse = 1,
  kBrachydSagittal = 2,
  kBrachydEndFire = 3,
  kBrachydBiplane = 4 /**< transverse and sagittal in turn; of BrachydScanner alone */
};

enum {
  kBrachydTokenBytes = 32,
  kBrachydNameBytes = 65,  /**< with the terminating zero, as below */
  kBrachydTextBytes = 513, /**< texts are UTF-8 without control characters, and cut where they are longer */
  kBrachydPathBytes = 4096,
  kBrachydAnyNeedle = 0xFFFF
};

typedef struct BrachydClient BrachydClient; /**< one connection and what came by it last */

/** Who connects. brachyd_init_options() fills in the defaults. */
typedef struct BrachydOptions {
  size_t struct_size; /**< set by brachyd_init_options() */
  int32_t role;       /**< BrachydRole; viewer */
  uint32_t subscription;
  uint32_t needle; /**< of a device: the one that it asks for, from 0; kBrachydAnyNeedle: any that is free */
  int32_t has_token; /**< 1: the server asks for one; it is in `token` */
  uint8_t token[kBrachydTokenBytes];
  char name[kBrachydNameBytes]; /**< by which logs and other clients know this one; "client" */
  double timeout_s;             /**< for brachyd_connect(), above 0 and at most 3600; 5 */
  /** What a device can do; NaN, the default: not stated, and the server takes a careful value. */
  double max_force_n, max_stiffness_n_per_mm, damping_n_s_per_mm, rate_hz;
  int32_t tls;                    /**< 1: TLS */
  char tls_ca[kBrachydPathBytes]; /**< PEM file of the server's authority, or its own; empty: the system's */
} BrachydOptions;

/** What the server granted. */
typedef struct BrachydWelcome {
  uint64_t session; /**< number of this connection */
  int32_t role;     /**< BrachydRole */
  uint32_t subscription;
  uint32_t needle;       /**< of a device: its own; else kBrachydAnyNeedle */
  uint32_t needle_count; /**< of the scene: numbers 0 … needle_count − 1 */
  double deformation_hz; /**< ticks a second */
  double snapshot_hz;    /**< meshes a second */
  uint32_t max_poses_per_s;
  char server[kBrachydNameBytes]; /**< name and version */
} BrachydWelcome;

/** The tissue at rest. The pointers hold until the next brachyd_poll(), brachyd_connect() or brachyd_destroy(). */
typedef struct BrachydTopology {
  uint64_t hash; /**< of what follows: a program that knows it need not build its mesh again */
  uint32_t point_count;
  uint32_t surface_vertex_count; /**< the first points are the surface's vertices */
  uint32_t triangle_count;
  const uint32_t* triangles;   /**< 3 · triangle_count, counter-clockwise seen from outside */
  const float* rest_positions; /**< 3 · point_count: x0 y0 z0 x1 …, mm, frame W */
} BrachydTopology;

/** The newest snapshot. */
typedef struct BrachydFrame {
  uint64_t tick; /**< of the simulation, 1 is the first; earlier than the last one's after a reset */
  uint64_t snapshot_sequence; /**< of the server; a jump: snapshots that this client did not get */
  double sim_time_s;
  uint64_t input_sequence; /**< number on the wire of the POSE that the tick used; 0: none yet */
  int64_t input_stamp_ns;  /**< that POSE's stamp, of its sender's clock: which it was */
  double max_displacement_mm;
  uint32_t step_flags; /**< what could not be done as asked: PROTOCOL.md, FRAME */
  uint32_t moved_vertices;
  uint32_t point_count;
  uint32_t needle_count; /**< for brachyd_get_needle() */
  uint32_t seed_count;   /**< for brachyd_get_seed() */
  /** Of the displacement field: 0 not known, 1 injective, 2 folded. A program that shows the mesh shows it too. */
  int32_t verdict;
  double lag_mm; /**< how far the points are behind the tick's field; NaN: not known */
} BrachydFrame;

/** A needle, or the ultrasound probe, in the newest snapshot. */
typedef struct BrachydNeedle {
  uint32_t id;
  int32_t present; /**< 0: no pose has come yet, and the rest means nothing */
  int32_t contact; /**< BrachydContact */
  uint32_t puncture_count;
  double insertion_depth_mm;
  double X_WN[12];
  int32_t has_force; /**< 0: force_n is not known */
  int32_t reserved;
  double force_n
      [3]; /**< what the tissue does to the needle, frame W; what a hand gets may be less: BrachydForce */
  double axial_n; /**< above 0 pushes the needle out */
} BrachydNeedle;

/** A seed that was left in the body. */
typedef struct BrachydSeed {
  uint32_t id;     /**< 1, 2, … in the order of falling */
  int32_t planned; /**< number in the plan, from 0; −1: it is not in it */
  uint32_t needle; /**< that left it; 65535: it was there at the start */
  int32_t fixed;   /**< 1: it fell outside the tissue and stays where it fell */
  double air_kerma_strength_u;
  double position[3], axis[3]; /**< now, mm; unit, along the needle towards its tip */
  double rest[3];              /**< once no needle deforms the tissue, mm */
} BrachydSeed;

/** What the hand of a device is to get. A program that renders it takes it to 0, by at most 0.5 N/ms, once it is older
 * than `valid_ms`, and when the connection ends: server, machine or network may stop. */
typedef struct BrachydForce {
  uint64_t tick;           /**< of the simulation that it rests on */
  uint64_t input_sequence; /**< number on the wire of the POSE that it answers; 0: none */
  int64_t input_stamp_ns;  /**< that POSE's stamp: which it was */
  int64_t received_ns;     /**< when it came, brachyd_now_ns() */
  double force_n[3];       /**< on the needle, frame W */
  double tip_torque_nmm[3], hub_torque_nmm[3];
  double axial_n, lateral_n, cutting_n, friction_n;
  uint32_t needle;
  uint32_t flags;    /**< BrachydForceFlag bits */
  uint32_t valid_ms; /**< from received_ns on */
  uint32_t reserved;
} BrachydForce;

/** How the server fares; twice a second. */
typedef struct BrachydState {
  uint64_t ticks, overruns; /**< overruns: deadlines missed */
  double tick_p50_ms, tick_p99_ms, tick_max_ms;
  double latency_p50_ms, latency_p99_ms,
      latency_max_ms; /**< from a pose's arrival to the mesh that used it */
  uint64_t poses_accepted, poses_refused;
  uint64_t snapshots, snapshots_sent, snapshots_dropped; /**< the last two of this client */
  uint64_t events_dropped;                               /**< that this client did not get */
  uint32_t clients, viewers;
  double support_radius_mm;
  uint32_t
      controls; /**< bit 0 there is a scripted needle, 1 it plays, 2 over and over, 3 a model is being prepared */
  uint32_t reserved;
  char kernel[kBrachydNameBytes];        /**< of the tissue's model */
  char device_holder[kBrachydTextBytes]; /**< who moves the needles; empty: nobody */
} BrachydState;

/** Something happened once. */
typedef struct BrachydEvent {
  uint64_t tick; /**< 0: before the first */
  uint32_t
      kind; /**< 3 puncture, 4 reset, 8 safety, 9 seed …: PROTOCOL.md, EVENT; of a number not listed show the text */
  uint32_t needle; /**< where it is about one */
  char text[kBrachydTextBytes];
} BrachydEvent;

/** A request that the server refused, or, where `fatal`, why it ended the connection. */
typedef struct BrachydError {
  uint64_t about_sequence; /**< of the message that it answers; 0: none */
  uint32_t code;           /**< 5 DEVICE_BUSY, 10 SHUTDOWN, 14 UNAUTHORISED …: PROTOCOL.md, ERROR */
  uint32_t reason;         /**< of a refused pose: PROTOCOL.md, POSE */
  int32_t fatal;
  char text[kBrachydTextBytes];
} BrachydError;

/** An ultrasound image. Its frame I: origin in the middle of the first pixel, +x along its row, +y down its columns. */
typedef struct BrachydImage {
  int32_t array;  /**< BrachydArray */
  uint32_t flags; /**< bit 0 held: of an earlier tick, 1 frozen, 3 uncertified: PROTOCOL.md, IMAGE */
  uint32_t width, height;
  uint64_t sequence, tick;
  double spacing_mm; /**< of pixels, in both directions */
  double X_WI[12];   /**< image to world, [R | p] row by row */
  const uint8_t*
      pixels; /**< width · height gray values, rows from the top; holds as those of BrachydTopology */
} BrachydImage;

/** The scanner's console and the probe's stepper. */
typedef struct BrachydScanner {
  int32_t array;  /**< BrachydArray */
  int32_t freeze; /**< 0 as it is, 1 live, 2 frozen */
  double depth_mm, gain_db, dynamic_range_db, tgc_extra_db_per_cm, focus_mm;
  double probe_depth_mm,
      probe_rotation_deg; /**< along the probe's axis, above 0 is deeper; turned about it */
} BrachydScanner;

/** Version of the library, such as "0.1.0". Threads: any. */
BRACHYD_API const char* brachyd_client_version(void);

/** A status in words; never NULL. Threads: any. */
BRACHYD_API const char* brachyd_status_text(int status);

/** This machine's monotonic clock, ns: of stamps of poses and of BrachydForce::received_ns. Threads: any. */
BRACHYD_API int64_t brachyd_now_ns(void);

/** Sets every member to its default. `size` is sizeof(BrachydOptions) where the program was compiled: libraries of
 * other versions keep to it. */
BRACHYD_API void brachyd_init_options(BrachydOptions* options, size_t size);

/** A handle without a connection; NULL: no memory. brachyd_destroy() frees it. */
BRACHYD_API BrachydClient* brachyd_create(void);

/** Closes the connection and frees the handle; NULL: nothing. What brachyd_poll() has not sent yet is lost. */
BRACHYD_API void brachyd_destroy(BrachydClient* client);

/** Connects to host:port and waits for the server's welcome, at most about timeout_s and the name's look-up. The server
 * may be gone later: a handle may connect again, which forgets all that came before. Options NULL: the defaults.
 * Returns kBrachydOk, kBrachydBadArgument, kBrachydUnreachable, kBrachydRefused, kBrachydClosed (the peer speaks
 * another protocol, or left) or kBrachydInternal. */
BRACHYD_API int brachyd_connect(BrachydClient* client, const char* host, int port,
                                const BrachydOptions* options);

/** Ends the connection; what came last stays readable. What brachyd_poll() has not sent yet is lost. */
BRACHYD_API void brachyd_close(BrachydClient* client);

/** 1: there is a connection. */
BRACHYD_API int brachyd_is_open(const BrachydClient* client);

/** Why the last function that failed did, in one line, such as "nothing listens on 127.0.0.1:18950: …"; "" if none
 * did. Valid until the next call with this handle. */
BRACHYD_API const char* brachyd_error_text(const BrachydClient* client);

/** Serves the connection: sends what waits, reads all that has arrived, answers PINGs. Waits for the first message at
 * most timeout_s (0: not at all; at most 3600). Returns BrachydNews bits, 0 where nothing came in that time,
 * kBrachydRefused or kBrachydClosed once the connection has ended and all that came before it was reported, or
 * kBrachydBadArgument. Call it at least once a second, and a viewer at least as often as it draws: a server closes
 * clients that do not read. */
BRACHYD_API int brachyd_poll(BrachydClient* client, double timeout_s);

/** What the server granted: kBrachydOk, or kBrachydNothing before the first brachyd_connect() that succeeded. */
BRACHYD_API int brachyd_get_welcome(const BrachydClient* client, BrachydWelcome* welcome);

/** The mesh at rest; it comes once, and again only after brachyd_connect(). */
BRACHYD_API int brachyd_get_topology(const BrachydClient* client, BrachydTopology* topology);

/** The newest snapshot's numbers. kBrachydNothing before the first. */
BRACHYD_API int brachyd_get_frame(const BrachydClient* client, BrachydFrame* frame);

/** The points as the newest snapshot has them, 3 · point_count: x0 y0 z0 x1 …, mm, frame W; before the first snapshot
 * those at rest; NULL before the topology. The pointer holds as those of BrachydTopology. */
BRACHYD_API const float* brachyd_positions(const BrachydClient* client);

/** Needle `index` of the newest snapshot, from 0; kBrachydBadArgument beyond the last. */
BRACHYD_API int brachyd_get_needle(const BrachydClient* client, uint32_t index, BrachydNeedle* needle);

/** Seed `index` in the order of falling, from 0; kBrachydBadArgument beyond the last. */
BRACHYD_API int brachyd_get_seed(const BrachydClient* client, uint32_t index, BrachydSeed* seed);

/** The newest force of a device. */
BRACHYD_API int brachyd_get_force(const BrachydClient* client, BrachydForce* force);

/** The newest state. */
BRACHYD_API int brachyd_get_state(const BrachydClient* client, BrachydState* state);

/** The next event that waits: kBrachydOk, or kBrachydNothing. At most 256 wait; beyond that the oldest are dropped. */
BRACHYD_API int brachyd_next_event(BrachydClient* client, BrachydEvent* event);

/** The next ERROR that waits, as events; also after the connection ended, or was refused. */
BRACHYD_API int brachyd_next_error(BrachydClient* client, BrachydError* error);

/** The newest image of an array (BrachydArray). */
BRACHYD_API int brachyd_get_image(const BrachydClient* client, int array, BrachydImage* image);

/** What is set at the scanner. */
BRACHYD_API int brachyd_get_scanner(const BrachydClient* client, BrachydScanner* scanner);

/** As device: where the needle is, X_WN, taken at `stamp_ns` of brachyd_now_ns() (0: now). Sends it, or queues it for
 * the next brachyd_poll() where another message is still being sent; of more than 64 that wait the oldest is dropped.
 * Refused with kBrachydBadArgument, and nothing is sent: a number that is not finite. While tracking is lost send
 * nothing. At most BrachydWelcome::max_poses_per_s. What the server refuses comes by brachyd_next_error(). */
BRACHYD_API int brachyd_send_pose(BrachydClient* client, const double X_WN[12], int64_t stamp_ns);

/** Ends the fault for which a needle's force is latched at 0: of a device its own, of an operator any. */
BRACHYD_API int brachyd_arm(BrachydClient* client, uint32_t needle);

/** The button of the needle's device went down (1) or up (0), which drops seeds as the scene's applicator says. In
 * order with the poses, and never dropped. */
BRACHYD_API int brachyd_press(BrachydClient* client, uint32_t needle, int pressed);

/** As operator: BrachydAction. Kernel (NULL: as it is) and support_radius_mm (NaN: as it is) are those of
 * kBrachydModel, `loop` is that of kBrachydPlay. A state follows, or an error. */
BRACHYD_API int brachyd_control(BrachydClient* client, int action, int loop, const char* kernel,
                                double support_radius_mm);

/** As operator, or as the probe's device: sets the scanner; 0 and NaN leave things as they are. */
BRACHYD_API int brachyd_set_scanner(BrachydClient* client, const BrachydScanner* scanner);

/** As operator: loads a needle with the seeds of a needle of the plan; 0xFFFF: as if nobody had loaded it. */
BRACHYD_API int brachyd_load(BrachydClient* client, uint32_t needle, uint32_t plan_needle);

/** Asks for a state now. */
BRACHYD_API int brachyd_request_state(BrachydClient* client);

#ifdef __cplusplus
}
#endif

#endif
