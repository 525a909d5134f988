// Shows brachyd's deforming gland in Unity: put it on an object with a MeshFilter and a MeshRenderer. The native library
// goes to Assets/Plugins, BrachydClient.cs and this file anywhere below Assets.

using Brachyd;
using UnityEngine;

[RequireComponent(typeof(MeshFilter))]
public class GlandMesh : MonoBehaviour
{
    public string host = "127.0.0.1";
    public int port = 18950;
    /// <summary>64 hexadecimal digits, where the server asks for a token.</summary>
    public string token = "";

    Client client;
    Mesh mesh;
    float[] positions;
    Vector3[] vertices;

    void Start()
    {
        Options options = Options.Default();
        options.Name = "Unity";
        options.Subscription = Subscription.Surface;
        if (token.Length > 0) options.Token = token;
        client = new Client();
        try
        {
            client.Connect(host, port, options);
        }
        catch (BrachydException problem)
        {
            Debug.LogError(problem.Message);
            enabled = false;
        }
    }

    void Update()
    {
        try
        {
            News news = client.Poll(0);  // all that has arrived since the last picture; the last mesh is shown
            if ((news & News.Topology) != 0) Build(client.GetTopology());
            if ((news & News.Frame) != 0) Move();
            while (client.TryNextEvent(out Brachyd.Event next)) Debug.Log(next.Message);
        }
        catch (BrachydException problem)
        {
            Debug.LogError(problem.Message);
            enabled = false;
        }
    }

    void OnDestroy()
    {
        if (client != null) client.Dispose();
    }

    void Build(Topology topology)
    {
        positions = topology.RestPositions;
        vertices = new Vector3[topology.PointCount];
        mesh = new Mesh();
        mesh.MarkDynamic();
        Convert();
        mesh.vertices = vertices;
        // The mirrored x turns counter-clockwise into Unity's clockwise: corners stay in their order.
        mesh.triangles = topology.Triangles;
        mesh.RecalculateNormals();
        GetComponent<MeshFilter>().mesh = mesh;
    }

    void Move()
    {
        client.CopyPositions(positions);
        Convert();
        mesh.vertices = vertices;
        mesh.RecalculateNormals();
        mesh.RecalculateBounds();
    }

    /// From W (patient RAS, right-handed, mm) to Unity (left-handed, y up, m), as the physician sees it from the patient's
    /// feet: the patient's right is on the left, anterior is up, and the needle goes forward.
    void Convert()
    {
        for (int i = 0; i < vertices.Length; ++i)
            vertices[i] = new Vector3(-1e-3f * positions[3 * i], 1e-3f * positions[3 * i + 1], 1e-3f * positions[3 * i + 2]);
    }
}
