// The client of scripts/conformance/README.md on apps/csharp: HOST PORT ROLE [TOKEN]. Prints what it receives.

using System;
using System.Globalization;
using System.Text;
using Brachyd;

static class ConformanceClient {
  static string Quoted(string text) { return "\"" + text.Replace("\\", "\\\\").Replace("\"", "\\\"") + "\""; }

  static string Number(double x) { return x.ToString("R", CultureInfo.InvariantCulture); }

  /// 64-bit FNV-1a over the points' bytes.
  static ulong Checksum(float[] positions) {
    byte[] bytes = new byte[4 * positions.Length];
    Buffer.BlockCopy(positions, 0, bytes, 0, bytes.Length);
    ulong value = 0xcbf29ce484222325;
    foreach (byte one in bytes) value = unchecked((value ^ one) * 0x100000001b3);
    return value;
  }

  /// The tracker's pose number k: a straight needle; in some of them it has lost the needle.
  static double[] Track(int k) {
    bool isLost = k % 50 == 10 || k % 50 == 11;
    return new[] { 1, 0, 0, isLost ? double.NaN : 5, 0, 1, 0, 0, 0, 0, 1, -30 + 0.25 * Math.Min(k, 240) };
  }

  static void PrintNews(Client client, News news) {
    if ((news & News.Topology) != 0) {
      Topology topology = client.GetTopology();
      Console.WriteLine("{\"topology\": {\"hash\": \"" + topology.Hash.ToString("x16") + "\", \"points\": " +
                        topology.PointCount + ", \"triangles\": " + topology.Triangles.Length / 3 + "}}");
    }
    if ((news & News.Frame) != 0 && client.TryGetFrame(out Frame frame)) {
      float[] positions = new float[3 * frame.PointCount];
      client.CopyPositions(positions);
      Console.WriteLine("{\"frame\": {\"tick\": " + frame.Tick + ", \"mesh\": \"" +
                        Checksum(positions).ToString("x16") + "\"}}");
    }
    if ((news & News.Force) != 0 && client.TryGetForce(out Force force))
      Console.WriteLine("{\"force\": {\"input_stamp_ns\": " + force.InputStampNs + ", \"force_n\": [" +
                        Number(force.ForceN[0]) + ", " + Number(force.ForceN[1]) + ", " +
                        Number(force.ForceN[2]) + "]}}");
    while (client.TryNextEvent(out Event next))
      Console.WriteLine("{\"event\": {\"kind\": " + next.Kind + ", \"text\": " + Quoted(next.Message) + "}}");
    while (client.TryNextError(out Error error))
      Console.WriteLine("{\"error\": {\"code\": " + error.Code + ", \"fatal\": " + (error.Fatal ? 1 : 0) +
                        ", \"text\": " + Quoted(error.Message) + "}}");
  }

  static void Serve(Client client, bool isDevice) {
    client.TryGetWelcome(out Welcome welcome);
    Console.WriteLine("{\"welcome\": {\"role\": " + (int)welcome.Role + ", \"needle\": " + welcome.Needle +
                      ", \"server\": " + Quoted(welcome.Server) + "}}");
    long intervalNs = Math.Max(10000000, 1000000000 / Math.Max(1, (long)welcome.MaxPosesPerS)),
         nextNs = Client.NowNs;
    bool wasLatched = false;
    for (int k = 0;;) {
      PrintNews(client, client.Poll(isDevice ? Math.Max(0, 1e-9 * (nextNs - Client.NowNs)) : 0.5));
      if (client.TryGetForce(out Force force)) {
        bool isLatched = (force.Flags & ForceFlags.Latched) != 0;
        if (isLatched && !wasLatched)
          client.Arm(force.Needle);
        wasLatched = isLatched;
      }
      if (!isDevice || Client.NowNs < nextNs)
        continue;
      double[] X_WN = Track(k++);
      nextNs = Client.NowNs + intervalNs;
      if (!double.IsNaN(X_WN[3]))
        client.SendPose(X_WN);
    }
  }

  static int Main(string[] arguments) {
    var output = new System.IO.StreamWriter(Console.OpenStandardOutput(), new UTF8Encoding(false));
    output.AutoFlush = true;
    Console.SetOut(output);
    bool isDevice = arguments[2] == "device";
    Options options = Options.Default();
    options.Name = "conformance in C#";
    options.Role = isDevice ? Role.Device : Role.Viewer;
    options.Subscription = isDevice ? Subscription.NoMesh : Subscription.None;
    if (arguments.Length > 3)
      options.Token = arguments[3];
    using (var client = new Client()) {
      try {
        client.Connect(arguments[0], int.Parse(arguments[1]), options);
        Serve(client, isDevice);
      } catch (BrachydException end) {
        PrintNews(client, News.None);
        Console.WriteLine("{\"closed\": " + Quoted(end.Message) + "}");
      }
    }
    return 0;
  }
}
