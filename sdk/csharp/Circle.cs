using System;
using System.Collections.Generic;
using System.Linq;
using Gramian.Api;
using Gramian.Model;

/// <summary>Prints the mean curvatures of a circle of radius 1.</summary>
public static class Circle
{
    public static void Main()
    {
        // begin README
        var geometry = new GeometryApi(Environment.GetEnvironmentVariable("GRAMIAN_URL"));
        var request = new CurvaturesRequest(new CloudInput(points: Points(8)));
        var answer = geometry.ComputeCurvatures(request);
        Console.WriteLine(string.Join(" ", answer.MeanCurvatures));
        // end README
    }

    private static List<List<double>> Points(int n)
    {
        var angles = Enumerable.Range(0, n).Select(i => 2 * Math.PI * i / n);
        return angles.Select(angle => new List<double> { Math.Cos(angle), Math.Sin(angle) }).ToList();
    }
}
