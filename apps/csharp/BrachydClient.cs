// A client of brachyd in C#, on the C API (net/c_api/brachyd_client.h, whose comments say what each number means).
// C# 7, netstandard 2.0; needs libbrachyd-client beside the program or where the system looks for libraries.

using System;
using System.Runtime.InteropServices;
using System.Text;

namespace Brachyd
{
    public enum Role { Viewer = 1, Device = 2, Operator = 3 }

    [Flags]
    public enum Subscription : uint { None = 0, FullFrames = 1, Surface = 4, NoMesh = 8, Ultrasound = 32 }

    /// <summary>What Poll() returns: what came.</summary>
    [Flags]
    public enum News { None = 0, Topology = 1, Frame = 2, Force = 4, State = 8, Event = 16, Error = 32, Image = 64, Scanner = 128 }

    public enum Contact { Free = 0, Touching = 1, Inserted = 2, Through = 3, Withdrawn = 4 }

    [Flags]
    public enum ForceFlags : uint { None = 0, Armed = 1, Ramping = 2, Latched = 4, Limited = 8, Expired = 16 }

    public enum ControlAction { Play = 1, Stop = 2, Reset = 3, Model = 4 }

    public enum ScannerArray { Any = 0, Transverse = 1, Sagittal = 2, EndFire = 3, Biplane = 4 }

    public enum Status { Ok = 0, BadArgument = -1, Unreachable = -2, Refused = -3, Closed = -4, Nothing = -5, Internal = -6 }

    /// <summary>A call that failed; Status says in what way, Message why.</summary>
    public sealed class BrachydException : Exception
    {
        public Status Status { get; }
        public BrachydException(Status status, string message) : base(message) { Status = status; }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Options
    {
        internal UIntPtr StructSize;
        public Role Role;
        public Subscription Subscription;
        public uint Needle;
        internal int HasToken;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 32)] internal byte[] TokenBytes;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 65)] internal byte[] NameBytes;
        public double TimeoutS;
        public double MaxForceN, MaxStiffnessNPerMm, DampingNSPerMm, RateHz;
        internal int Tls;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 4096)] internal byte[] TlsCaBytes;

        /// <summary>The defaults: a viewer.</summary>
        public static Options Default()
        {
            var size = (UIntPtr)Marshal.SizeOf(typeof(Options));
            Native.brachyd_init_options(out Options options, size);
            return options;
        }

        public string Name { set { NameBytes = Text.ToBytes(value, 65); } }

        /// <summary>64 hexadecimal digits, for a server that asks for a token.</summary>
        public string Token
        {
            set
            {
                if (value == null || value.Length != 64) throw new ArgumentException("a token has 64 hexadecimal digits");
                for (int i = 0; i < 32; ++i) TokenBytes[i] = Convert.ToByte(value.Substring(2 * i, 2), 16);
                HasToken = 1;
            }
        }

        /// <summary>TLS; a PEM file of the server's authority, or "" for the system's.</summary>
        public string TlsAuthority
        {
            set
            {
                TlsCaBytes = Text.ToBytes(value, 4096);
                Tls = 1;
            }
        }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Welcome
    {
        public ulong Session;
        public Role Role;
        public Subscription Subscription;
        public uint Needle, NeedleCount;
        public double DeformationHz, SnapshotHz;
        public uint MaxPosesPerS;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 65)] internal byte[] ServerBytes;
        public string Server => Text.FromBytes(ServerBytes);
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Frame
    {
        public ulong Tick, SnapshotSequence;
        public double SimTimeS;
        public ulong InputSequence;
        public long InputStampNs;
        public double MaxDisplacementMm;
        public uint StepFlags, MovedVertices, PointCount, NeedleCount, SeedCount;
        public int Verdict;
        public double LagMm;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Needle
    {
        public uint Id;
        internal int PresentInt;
        public Contact Contact;
        public uint PunctureCount;
        public double InsertionDepthMm;
        /// <summary>Needle to world, [R | p] row by row, mm.</summary>
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 12)] public double[] X_WN;
        internal int HasForceInt, Reserved;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] ForceN;
        public double AxialN;
        public bool Present => PresentInt != 0;
        public bool HasForce => HasForceInt != 0;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Seed
    {
        public uint Id;
        public int Planned;
        public uint Needle;
        internal int FixedInt;
        public double AirKermaStrengthU;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] Position;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] Axis;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] Rest;
        public bool Fixed => FixedInt != 0;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Force
    {
        public ulong Tick, InputSequence;
        public long InputStampNs, ReceivedNs;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] ForceN;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] TipTorqueNmm;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] HubTorqueNmm;
        public double AxialN, LateralN, CuttingN, FrictionN;
        public uint Needle;
        public ForceFlags Flags;
        public uint ValidMs;
        internal uint Reserved;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct State
    {
        public ulong Ticks, Overruns;
        public double TickP50Ms, TickP99Ms, TickMaxMs, LatencyP50Ms, LatencyP99Ms, LatencyMaxMs;
        public ulong PosesAccepted, PosesRefused, Snapshots, SnapshotsSent, SnapshotsDropped, EventsDropped;
        public uint Clients, Viewers;
        public double SupportRadiusMm;
        public uint Controls;
        internal uint Reserved;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 65)] internal byte[] KernelBytes;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 513)] internal byte[] DeviceHolderBytes;
        public string Kernel => Text.FromBytes(KernelBytes);
        public string DeviceHolder => Text.FromBytes(DeviceHolderBytes);
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Event
    {
        public ulong Tick;
        public uint Kind, Needle;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 513)] internal byte[] TextBytes;
        public string Message => Text.FromBytes(TextBytes);
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Error
    {
        public ulong AboutSequence;
        public uint Code, Reason;
        internal int FatalInt;
        [MarshalAs(UnmanagedType.ByValArray, SizeConst = 513)] internal byte[] TextBytes;
        public bool Fatal => FatalInt != 0;
        public string Message => Text.FromBytes(TextBytes);
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Scanner
    {
        public ScannerArray Array;
        public int Freeze;
        public double DepthMm, GainDb, DynamicRangeDb, TgcExtraDbPerCm, FocusMm, ProbeDepthMm, ProbeRotationDeg;

        /// <summary>A request that leaves all as it is.</summary>
        public static Scanner AsItIs()
        {
            const double nan = double.NaN;
            return new Scanner { DepthMm = nan, GainDb = nan, DynamicRangeDb = nan, TgcExtraDbPerCm = nan, FocusMm = nan,
                                 ProbeDepthMm = nan, ProbeRotationDeg = nan };
        }
    }

    /// <summary>The tissue at rest: points x0 y0 z0 x1 …, mm, frame W, and corners of triangles.</summary>
    public sealed class Topology
    {
        public ulong Hash;
        public int PointCount, SurfaceVertexCount;
        public int[] Triangles;
        public float[] RestPositions;
    }

    /// <summary>An ultrasound image: gray values in rows from the top.</summary>
    public sealed class Image
    {
        public ScannerArray Array;
        public uint Flags;
        public int Width, Height;
        public ulong Sequence, Tick;
        public double SpacingMm;
        public double[] X_WI;
        public byte[] Pixels;
    }

    /// <summary>One connection. One thread at a time; Dispose() closes it.</summary>
    public sealed class Client : IDisposable
    {
        IntPtr handle;

        public Client()
        {
            handle = Native.brachyd_create();
            if (handle == IntPtr.Zero) throw new OutOfMemoryException();
        }

        ~Client() { Free(); }

        public void Dispose()
        {
            Free();
            GC.SuppressFinalize(this);
        }

        void Free()
        {
            Native.brachyd_destroy(handle);
            handle = IntPtr.Zero;
        }

        public static string Version => Text.FromPointer(Native.brachyd_client_version());
        /// <summary>The clock of poses' stamps, ns.</summary>
        public static long NowNs => Native.brachyd_now_ns();
        public bool IsOpen => Native.brachyd_is_open(handle) != 0;
        public string ErrorText => Text.FromPointer(Native.brachyd_error_text(handle));

        /// <summary>Connects and waits for the welcome.</summary>
        public void Connect(string host, int port, Options options)
        {
            Check(Native.brachyd_connect(handle, Text.ToBytes(host, Encoding.UTF8.GetByteCount(host) + 1), port, ref options));
        }

        public void Close() { Native.brachyd_close(handle); }

        /// <summary>Serves the connection; waits for the first message at most that long. Throws once it has ended and all
        /// that came before was reported.</summary>
        public News Poll(double timeoutS)
        {
            return (News)Check(Native.brachyd_poll(handle, timeoutS));
        }

        public bool TryGetWelcome(out Welcome welcome) { return Has(Native.brachyd_get_welcome(handle, out welcome)); }
        public bool TryGetFrame(out Frame frame) { return Has(Native.brachyd_get_frame(handle, out frame)); }
        public bool TryGetForce(out Force force) { return Has(Native.brachyd_get_force(handle, out force)); }
        public bool TryGetState(out State state) { return Has(Native.brachyd_get_state(handle, out state)); }
        public bool TryGetScanner(out Scanner scanner) { return Has(Native.brachyd_get_scanner(handle, out scanner)); }
        public bool TryNextEvent(out Event next) { return Has(Native.brachyd_next_event(handle, out next)); }
        public bool TryNextError(out Error next) { return Has(Native.brachyd_next_error(handle, out next)); }

        public Needle GetNeedle(uint index)
        {
            Check(Native.brachyd_get_needle(handle, index, out Needle needle));
            return needle;
        }

        public Seed GetSeed(uint index)
        {
            Check(Native.brachyd_get_seed(handle, index, out Seed seed));
            return seed;
        }

        /// <summary>The mesh at rest; null before it came.</summary>
        public Topology GetTopology()
        {
            if (!Has(Native.brachyd_get_topology(handle, out Native.TopologyView view))) return null;
            var topology = new Topology { Hash = view.Hash, PointCount = (int)view.PointCount,
                                          SurfaceVertexCount = (int)view.SurfaceVertexCount,
                                          Triangles = new int[3 * view.TriangleCount],
                                          RestPositions = new float[3 * view.PointCount] };
            if (topology.Triangles.Length > 0) Marshal.Copy(view.Triangles, topology.Triangles, 0, topology.Triangles.Length);
            if (topology.RestPositions.Length > 0)
                Marshal.Copy(view.RestPositions, topology.RestPositions, 0, topology.RestPositions.Length);
            return topology;
        }

        /// <summary>The points of the newest snapshot into an array of the topology's size; false before the mesh came.</summary>
        public bool CopyPositions(float[] positions)
        {
            IntPtr from = Native.brachyd_positions(handle);
            if (from == IntPtr.Zero || !Has(Native.brachyd_get_topology(handle, out Native.TopologyView view))) return false;
            if (positions.Length < 3 * view.PointCount) throw new ArgumentException("the array is smaller than the mesh");
            Marshal.Copy(from, positions, 0, (int)(3 * view.PointCount));
            return true;
        }

        /// <summary>The newest image of an array; null before one came.</summary>
        public Image GetImage(ScannerArray array)
        {
            if (!Has(Native.brachyd_get_image(handle, (int)array, out Native.ImageView view))) return null;
            var image = new Image { Array = view.Array, Flags = view.Flags, Width = (int)view.Width, Height = (int)view.Height,
                                    Sequence = view.Sequence, Tick = view.Tick, SpacingMm = view.SpacingMm, X_WI = view.X_WI,
                                    Pixels = new byte[view.Width * view.Height] };
            Marshal.Copy(view.Pixels, image.Pixels, 0, image.Pixels.Length);
            return image;
        }

        /// <summary>As device: needle to world, [R | p] row by row, 12 numbers, mm. Throws for a number that is not finite: send
        /// nothing while tracking is lost.</summary>
        public void SendPose(double[] X_WN, long stampNs = 0)
        {
            if (X_WN == null || X_WN.Length != 12) throw new ArgumentException("a pose has 12 numbers");
            Check(Native.brachyd_send_pose(handle, X_WN, stampNs));
        }

        public void Arm(uint needle) { Check(Native.brachyd_arm(handle, needle)); }
        public void Press(uint needle, bool pressed) { Check(Native.brachyd_press(handle, needle, pressed ? 1 : 0)); }
        public void Load(uint needle, uint planNeedle) { Check(Native.brachyd_load(handle, needle, planNeedle)); }
        public void SetScanner(Scanner scanner) { Check(Native.brachyd_set_scanner(handle, ref scanner)); }
        public void RequestState() { Check(Native.brachyd_request_state(handle)); }

        public void Control(ControlAction action, bool loop = false, string kernel = null, double supportRadiusMm = double.NaN)
        {
            byte[] name = kernel == null ? null : Text.ToBytes(kernel, Encoding.UTF8.GetByteCount(kernel) + 1);
            Check(Native.brachyd_control(handle, (int)action, loop ? 1 : 0, name, supportRadiusMm));
        }

        int Check(int status)
        {
            if (status >= 0) return status;
            string why = ErrorText;
            throw new BrachydException((Status)status,
                                       why.Length > 0 ? why : Text.FromPointer(Native.brachyd_status_text(status)));
        }

        bool Has(int status)
        {
            if (status == (int)Status.Nothing) return false;
            Check(status);
            return true;
        }
    }

    static class Text
    {
        /// <summary>UTF-8 with a terminating zero in an array of that size; a longer text is cut.</summary>
        public static byte[] ToBytes(string text, int size)
        {
            byte[] bytes = new byte[size], utf8 = Encoding.UTF8.GetBytes(text);
            System.Array.Copy(utf8, bytes, Math.Min(utf8.Length, size - 1));
            return bytes;
        }

        public static string FromBytes(byte[] bytes)
        {
            return Encoding.UTF8.GetString(bytes, 0, Math.Max(0, System.Array.IndexOf(bytes, (byte)0)));
        }

        public static string FromPointer(IntPtr text)
        {
            int length = 0;
            while (Marshal.ReadByte(text, length) != 0) ++length;
            byte[] bytes = new byte[length];
            Marshal.Copy(text, bytes, 0, length);
            return Encoding.UTF8.GetString(bytes);
        }
    }

    static class Native
    {
        /// <summary>brachyd-client.dll, libbrachyd-client.so, …; where only the soname's file is installed (libbrachyd-client0
        /// without -dev) mono maps it: apps/csharp/README.md.</summary>
        const string Library = "brachyd-client";

        [StructLayout(LayoutKind.Sequential)]
        public struct TopologyView
        {
            public ulong Hash;
            public uint PointCount, SurfaceVertexCount, TriangleCount;
            public IntPtr Triangles, RestPositions;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct ImageView
        {
            public ScannerArray Array;
            public uint Flags, Width, Height;
            public ulong Sequence, Tick;
            public double SpacingMm;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 12)] public double[] X_WI;
            public IntPtr Pixels;
        }

        const CallingConvention C = CallingConvention.Cdecl;
        [DllImport(Library, CallingConvention = C)] public static extern IntPtr brachyd_client_version();
        [DllImport(Library, CallingConvention = C)] public static extern IntPtr brachyd_status_text(int status);
        [DllImport(Library, CallingConvention = C)] public static extern long brachyd_now_ns();
        [DllImport(Library, CallingConvention = C)] public static extern void brachyd_init_options(out Options options, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] public static extern IntPtr brachyd_create();
        [DllImport(Library, CallingConvention = C)] public static extern void brachyd_destroy(IntPtr client);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_connect(IntPtr client, byte[] host, int port, ref Options options);
        [DllImport(Library, CallingConvention = C)] public static extern void brachyd_close(IntPtr client);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_is_open(IntPtr client);
        [DllImport(Library, CallingConvention = C)] public static extern IntPtr brachyd_error_text(IntPtr client);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_poll(IntPtr client, double timeoutS);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_get_welcome(IntPtr client, out Welcome welcome);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_get_topology(IntPtr client, out TopologyView topology);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_get_frame(IntPtr client, out Frame frame);
        [DllImport(Library, CallingConvention = C)] public static extern IntPtr brachyd_positions(IntPtr client);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_get_needle(IntPtr client, uint index, out Needle needle);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_get_seed(IntPtr client, uint index, out Seed seed);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_get_force(IntPtr client, out Force force);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_get_state(IntPtr client, out State state);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_next_event(IntPtr client, out Event next);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_next_error(IntPtr client, out Error next);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_get_image(IntPtr client, int array, out ImageView image);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_get_scanner(IntPtr client, out Scanner scanner);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_send_pose(IntPtr client, double[] X_WN, long stampNs);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_arm(IntPtr client, uint needle);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_press(IntPtr client, uint needle, int pressed);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_control(IntPtr client, int action, int loop, byte[] kernel, double supportRadiusMm);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_set_scanner(IntPtr client, ref Scanner scanner);
        [DllImport(Library, CallingConvention = C)]
        public static extern int brachyd_load(IntPtr client, uint needle, uint planNeedle);
        [DllImport(Library, CallingConvention = C)] public static extern int brachyd_request_state(IntPtr client);
    }
}
