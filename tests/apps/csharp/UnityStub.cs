// As much of UnityEngine as apps/csharp/examples/GlandMesh.cs uses, and a program that calls the script as Unity would.

using System;
using System.Linq;
using System.Reflection;

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
    }

    public class Mesh
    {
        public Vector3[] vertices;
        public int[] triangles;
        public void MarkDynamic() {}
        public void RecalculateNormals() {}
        public void RecalculateBounds() {}
    }

    public class MeshFilter { public Mesh mesh; }

    public class MonoBehaviour
    {
        public bool enabled = true;
        readonly MeshFilter filter = new MeshFilter();
        public T GetComponent<T>() where T : class { return filter as T; }
    }

    public class RequireComponent : Attribute { public RequireComponent(Type type) {} }

    public static class Debug
    {
        public static void Log(string text) { Console.Error.WriteLine(text); }
        public static void LogError(string text) { Console.Error.WriteLine(text); }
    }
}

static class UnityRun
{
    static void Call(object script, string name)
    {
        script.GetType().GetMethod(name, BindingFlags.NonPublic | BindingFlags.Instance).Invoke(script, null);
    }

    /// PORT: updates until the gland has moved by a millimetre, and prints its size.
    static int Main(string[] arguments)
    {
        var script = new GlandMesh { port = int.Parse(arguments[0]) };
        Call(script, "Start");
        UnityEngine.Vector3[] first = null;
        float moved = 0;
        while (script.enabled && moved < 1e-3f)
        {
            Call(script, "Update");
            System.Threading.Thread.Yield();
            UnityEngine.Mesh mesh = script.GetComponent<UnityEngine.MeshFilter>().mesh;
            if (mesh == null) continue;
            if (first == null) first = mesh.vertices.ToArray();
            moved = mesh.vertices.Zip(first, (a, b) => Math.Abs(a.x - b.x) + Math.Abs(a.y - b.y) + Math.Abs(a.z - b.z)).Max();
        }
        if (script.enabled)
        {
            UnityEngine.Mesh mesh = script.GetComponent<UnityEngine.MeshFilter>().mesh;
            Console.WriteLine($"{mesh.vertices.Length} vertices, {mesh.triangles.Length / 3} triangles, " +
                              $"{(mesh.vertices.Max(v => v.x) - mesh.vertices.Min(v => v.x)):F3} m wide, " +
                              $"volume {Volume(mesh) * 1e6:F1} cm3");
        }
        Call(script, "OnDestroy");
        return script.enabled ? 0 : 1;
    }

    /// Signed, by Unity's rule: above 0 where triangles are clockwise seen from outside, in left-handed axes.
    static double Volume(UnityEngine.Mesh mesh)
    {
        double six = 0;
        for (int i = 0; i < mesh.triangles.Length; i += 3)
        {
            var a = mesh.vertices[mesh.triangles[i]];
            var b = mesh.vertices[mesh.triangles[i + 1]];
            var c = mesh.vertices[mesh.triangles[i + 2]];
            six += a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
        }
        return -six / 6;
    }
}
