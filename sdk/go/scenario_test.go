// The scenario that every client runs, against the server at GRAMIAN_URL.
package main

import (
	"context"
	"errors"
	"math"
	"os"
	"testing"

	"gramian"
)

const cloudID = "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c"

// Eight points of the unit circle.
var points = [][]float64{
	{1, 0}, {0.70710678, 0.70710678}, {0, 1}, {-0.70710678, 0.70710678},
	{-1, 0}, {-0.70710678, -0.70710678}, {0, -1}, {0.70710678, -0.70710678},
}

func TestScenario(t *testing.T) {
	client := connect()
	register(t, client)
	t.Run("the cloud is listed", func(t *testing.T) { theCloudIsListed(t, client) })
	t.Run("normals point outward", func(t *testing.T) { normalsPointOutward(t, client) })
	t.Run("curvatures are null at the centre", func(t *testing.T) { curvaturesAreNullAtTheCentre(t, client) })
	t.Run("the matrix turns cosines into their negatives", func(t *testing.T) { theMatrixNegatesCosines(t, client) })
	t.Run("the posterior has a variance", func(t *testing.T) { thePosteriorHasAVariance(t, client) })
	t.Run("a refusal names the field", func(t *testing.T) { aRefusalNamesTheField(t, client) })
	t.Run("a cloud is deleted once", func(t *testing.T) { aCloudIsDeletedOnce(t, client) })
}

func connect() *gramian.APIClient {
	configuration := gramian.NewConfiguration()
	configuration.Servers = gramian.ServerConfigurations{{URL: os.Getenv("GRAMIAN_URL")}}
	return gramian.NewAPIClient(configuration)
}

func register(t *testing.T, client *gramian.APIClient) {
	request := gramian.NewCloudRequest(points)
	cloud, _, err := client.CloudsAPI.CreateCloud(context.Background()).CloudRequest(*request).Execute()
	must(t, err)
	if cloud.CloudId != cloudID {
		t.Fatalf("the id should be %s, but is %s", cloudID, cloud.CloudId)
	}
}

func theCloudIsListed(t *testing.T, client *gramian.APIClient) {
	page, _, err := client.CloudsAPI.ListClouds(context.Background()).Limit(1000).Execute()
	must(t, err)
	for _, listed := range page.Clouds {
		if listed.CloudId == cloudID {
			return
		}
	}
	t.Errorf("the cloud should be in the list: %v", page.Clouds)
}

func normalsPointOutward(t *testing.T, client *gramian.APIClient) {
	request := gramian.NewNormalsRequest(cloud())
	request.SetKernel(gauss(2))
	request.SetAlpha(0)
	answer, _, err := client.GeometryAPI.ComputeNormals(context.Background()).NormalsRequest(*request).Execute()
	must(t, err)
	if len(answer.Normals) != len(points) {
		t.Fatalf("%d normals for %d points", len(answer.Normals), len(points))
	}
	for i, normal := range answer.Normals {
		if normal == nil || dot(*normal, points[i]) < 0.999 {
			t.Errorf("normal %d should be %v, but is %v", i, points[i], normal)
		}
	}
}

func curvaturesAreNullAtTheCentre(t *testing.T, client *gramian.APIClient) {
	request := gramian.NewCurvaturesRequest(cloud())
	request.SetKernel(gauss(2))
	request.SetAlpha(0)
	request.SetQueries([][]float64{{1, 0}, {0, 0}})
	answer, _, err := client.GeometryAPI.ComputeCurvatures(context.Background()).CurvaturesRequest(*request).Execute()
	must(t, err)
	onTheCircle, atTheCentre := answer.MeanCurvatures[0], answer.MeanCurvatures[1]
	if onTheCircle == nil || math.Abs(*onTheCircle-1) > 1e-6 {
		t.Errorf("the circle should have the curvature 1: %v", answer.MeanCurvatures)
	}
	if atTheCentre != nil || answer.Flags[0].Query != 1 {
		t.Errorf("the centre should have no curvature, but has %v", atTheCentre)
	}
}

func theMatrixNegatesCosines(t *testing.T, client *gramian.APIClient) {
	request := gramian.NewLaplaceBeltramiMatrixRequest(cloud())
	request.SetKernel(gauss(2))
	request.SetAlpha(0)
	operators := client.OperatorsAPI
	call := operators.AssembleLaplaceBeltramiMatrix(context.Background()).LaplaceBeltramiMatrixRequest(*request)
	answer, _, err := call.Execute()
	must(t, err)
	if len(answer.Matrix) != len(points) {
		t.Fatalf("%d rows for %d points", len(answer.Matrix), len(points))
	}
	for i, row := range answer.Matrix {
		applied := dot(*row, cosines())
		// Eight points on the circle take a wave of frequency 7 for a cosine, which adds the fraction
		// 48 I_7(1/2)/I_1(1/2) = 2.3e-6. The Bessel functions I_k are the Fourier coefficients of this kernel on
		// the circle, up to a factor.
		if math.Abs(applied+points[i][0]) > 5e-6 {
			t.Errorf("row %d: %g for the cosine %g", i, applied, points[i][0])
		}
	}
}

func thePosteriorHasAVariance(t *testing.T, client *gramian.APIClient) {
	request := gramian.NewPosteriorRequest(cloud(), cosines())
	request.SetAlpha(1e-6)
	request.SetQueries([][]float64{{0.9, 0.1}})
	request.SetInclude([]gramian.PosteriorQuantity{gramian.POSTERIORQUANTITY_VARIANCES})
	answer, _, err := client.ValuesAPI.ComputePosterior(context.Background()).PosteriorRequest(*request).Execute()
	must(t, err)
	if len(answer.Means) != 1 || len(answer.Variances) != 1 || !(answer.Variances[0] >= 0) {
		t.Errorf("one mean and one variance expected: %v, %v", answer.Means, answer.Variances)
	}
}

func aRefusalNamesTheField(t *testing.T, client *gramian.APIClient) {
	request := gramian.NewCurvaturesRequest(cloud())
	request.SetKernel(gauss(-1))
	_, _, err := client.GeometryAPI.ComputeCurvatures(context.Background()).CurvaturesRequest(*request).Execute()
	problem := problemOf(t, err)
	if problem.Type != "/problems/invalid-request" || problem.Errors[0].Pointer != "/kernel/length_scale" {
		t.Errorf("the problem should name the length: %+v", problem)
	}
}

func aCloudIsDeletedOnce(t *testing.T, client *gramian.APIClient) {
	_, err := client.CloudsAPI.CheckCloud(context.Background(), cloudID).Execute()
	must(t, err)
	_, err = client.CloudsAPI.DeleteCloud(context.Background(), cloudID).Execute()
	must(t, err)
	_, err = client.CloudsAPI.DeleteCloud(context.Background(), cloudID).Execute()
	if problem := problemOf(t, err); problem.Type != "/problems/unknown-cloud" {
		t.Errorf("a cloud should be deleted once: %+v", problem)
	}
}

func problemOf(t *testing.T, err error) gramian.Problem {
	t.Helper()
	var refusal *gramian.GenericOpenAPIError
	if !errors.As(err, &refusal) {
		t.Fatalf("this should be refused: %v", err)
	}
	problem, ok := refusal.Model().(gramian.Problem)
	if !ok {
		t.Fatalf("not a problem: %v", refusal)
	}
	return problem
}

func cloud() gramian.CloudInput {
	reference := gramian.NewCloudInput()
	reference.SetId(cloudID)
	return *reference
}

// exp(−r²/ℓ²)
func gauss(lengthScale float64) gramian.Kernel {
	kernel := gramian.NewKernel(gramian.KERNELFAMILY_GAUSS)
	kernel.SetLengthScale(lengthScale)
	return *kernel
}

// The values at the points.
func cosines() []float64 {
	values := make([]float64, len(points))
	for i, point := range points {
		values[i] = point[0]
	}
	return values
}

func dot(a, b []float64) float64 {
	sum := 0.0
	for i := range a {
		sum += a[i] * b[i]
	}
	return sum
}

func must(t *testing.T, err error) {
	t.Helper()
	if err != nil {
		t.Fatal(err)
	}
}
