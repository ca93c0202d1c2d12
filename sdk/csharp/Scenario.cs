using System;
using System.Collections.Generic;
using System.Linq;
using Gramian.Api;
using Gramian.Client;
using Gramian.Model;
using Newtonsoft.Json;

/// <summary>The scenario that every client runs, against the server at GRAMIAN_URL.</summary>
public static class Scenario
{
    private const string CloudId = "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c";

    // An alpha that the answers do not feel: the client leaves out numbers that are 0, and what is left out
    // is chosen by the service.
    private const double Alpha = 1e-14;

    private static readonly string Url = Environment.GetEnvironmentVariable("GRAMIAN_URL");
    private static readonly CloudsApi Clouds = new CloudsApi(Url);
    private static readonly GeometryApi Geometry = new GeometryApi(Url);
    private static readonly CloudInput Registered = new CloudInput(id: CloudId);

    /// <summary>Eight points of the unit circle.</summary>
    private static readonly List<List<double>> Points = new[,]
    {
        { 1, 0 }, { 0.70710678, 0.70710678 }, { 0, 1 }, { -0.70710678, 0.70710678 },
        { -1, 0 }, { -0.70710678, -0.70710678 }, { 0, -1 }, { 0.70710678, -0.70710678 }
    }.Cast<double>().Select((x, i) => new { x, i }).GroupBy(entry => entry.i / 2, entry => entry.x)
        .Select(point => point.ToList()).ToList();

    private static readonly List<double> Cosines = Points.Select(point => point[0]).ToList();

    public static void Main()
    {
        ACloudIsRegisteredAndListed();
        NormalsPointOutward();
        CurvaturesAreNullAtTheCentre();
        TheMatrixTurnsCosinesIntoTheirNegatives();
        ThePosteriorHasAVariance();
        ARefusalNamesTheField();
        ACloudIsDeletedOnce();
    }

    private static void ACloudIsRegisteredAndListed()
    {
        var cloud = Clouds.CreateCloud(new CloudRequest(Points));
        Check(cloud.CloudId == CloudId, cloud);
        var listed = Clouds.ListClouds(limit: 1000).Clouds;
        Check(listed.Any(one => one.CloudId == CloudId && one.NPoints == 8), listed.Count);
    }

    private static void NormalsPointOutward()
    {
        var normals = Geometry.ComputeNormals(new NormalsRequest(Registered, Gauss(2), Alpha)).Normals;
        Check(normals.Count == Points.Count, normals.Count);
        Check(normals.Zip(Points, Dot).All(cosine => cosine > 0.999), normals);
    }

    private static void CurvaturesAreNullAtTheCentre()
    {
        var queries = new List<List<double>> { new List<double> { 1, 0 }, new List<double> { 0, 0 } };
        var request = new CurvaturesRequest(Registered, Gauss(2), Alpha, queries: queries);
        var answer = Geometry.ComputeCurvatures(request);
        Check(Math.Abs(answer.MeanCurvatures[0].Value - 1) < 1e-6, answer);
        Check(answer.MeanCurvatures[1] == null && answer.Flags[0].Query == 1, answer);
    }

    private static void TheMatrixTurnsCosinesIntoTheirNegatives()
    {
        var request = new LaplaceBeltramiMatrixRequest(Registered, Gauss(2), Alpha);
        var matrix = new OperatorsApi(Url).AssembleLaplaceBeltramiMatrix(request).Matrix;
        Check(matrix.Count == Points.Count, matrix.Count);
        for (var i = 0; i < matrix.Count; i++)
        {
            // Eight points on the circle take a wave of frequency 7 for a cosine, which adds the fraction
            // 48 I_7(1/2)/I_1(1/2) = 2.3e-6. The Bessel functions I_k are the Fourier coefficients of this
            // kernel on the circle, up to a factor.
            var applied = Dot(matrix[i], Cosines);
            Check(Math.Abs(applied + Cosines[i]) < 5e-6, $"row {i}: {applied}");
        }
    }

    private static void ThePosteriorHasAVariance()
    {
        var queries = new List<List<double>> { new List<double> { 0.9, 0.1 } };
        var include = new List<PosteriorQuantity> { PosteriorQuantity.Variances };
        var request = new PosteriorRequest(Registered, alpha: 1e-6, values: Cosines, queries: queries, include: include);
        var answer = new ValuesApi(Url).ComputePosterior(request);
        Check(answer.Means.Count == 1 && answer.Variances.Single() >= 0, answer);
    }

    private static void ARefusalNamesTheField()
    {
        var request = new CurvaturesRequest(Registered, Gauss(-1));
        var problem = Refusal(422, () => Geometry.ComputeCurvatures(request));
        Check(problem.Type == "/problems/invalid-request", problem);
        Check(problem.Errors[0].Pointer == "/kernel/length_scale", problem);
    }

    private static void ACloudIsDeletedOnce()
    {
        Clouds.CheckCloud(CloudId);
        Clouds.DeleteCloud(CloudId);
        var problem = Refusal(404, () => Clouds.DeleteCloud(CloudId));
        Check(problem.Type == "/problems/unknown-cloud", problem);
    }

    private static Problem Refusal(int status, Action call)
    {
        try
        {
            call();
        }
        catch (ApiException refused)
        {
            Check(refused.ErrorCode == status, refused);
            return JsonConvert.DeserializeObject<Problem>((string)refused.ErrorContent);
        }
        throw new InvalidOperationException("this should be refused");
    }

    /// <summary>exp(−r²/ℓ²)</summary>
    private static Kernel Gauss(double lengthScale)
    {
        return new Kernel(KernelFamily.Gauss, lengthScale);
    }

    private static double Dot(List<double> a, List<double> b)
    {
        Check(a.Count == b.Count, a.Count);
        return a.Zip(b, (x, y) => x * y).Sum();
    }

    private static void Check(bool holds, object found)
    {
        if (!holds)
        {
            throw new InvalidOperationException($"found {found}");
        }
    }
}
