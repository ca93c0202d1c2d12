import gramian.client.ApiClient;
import gramian.client.ApiException;
import gramian.client.JSON;
import gramian.client.api.CloudsApi;
import gramian.client.api.GeometryApi;
import gramian.client.api.OperatorsApi;
import gramian.client.api.ValuesApi;
import gramian.client.model.CloudInput;
import gramian.client.model.CloudRequest;
import gramian.client.model.CurvaturesRequest;
import gramian.client.model.Kernel;
import gramian.client.model.KernelFamily;
import gramian.client.model.LaplaceBeltramiMatrixRequest;
import gramian.client.model.NormalsRequest;
import gramian.client.model.PosteriorQuantity;
import gramian.client.model.PosteriorRequest;
import gramian.client.model.Problem;
import java.util.List;

/** The scenario that every client runs, against the server at GRAMIAN_URL. */
public class Scenario {
    /** Eight points of the unit circle. */
    private static final List<List<Double>> POINTS = List.of(
            List.of(1.0, 0.0), List.of(0.70710678, 0.70710678), List.of(0.0, 1.0), List.of(-0.70710678, 0.70710678),
            List.of(-1.0, 0.0), List.of(-0.70710678, -0.70710678), List.of(0.0, -1.0),
            List.of(0.70710678, -0.70710678));
    private static final List<Double> COSINES = POINTS.stream().map(point -> point.get(0)).toList();
    private static final String CLOUD_ID = "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c";

    private final ApiClient client = new ApiClient().setBasePath(System.getenv("GRAMIAN_URL"));
    private final CloudsApi clouds = new CloudsApi(client);
    private final GeometryApi geometry = new GeometryApi(client);

    public static void main(String[] arguments) throws ApiException {
        Scenario scenario = new Scenario();
        scenario.aCloudIsRegisteredAndListed();
        scenario.normalsPointOutward();
        scenario.curvaturesAreNullAtTheCentre();
        scenario.theMatrixTurnsCosinesIntoTheirNegatives();
        scenario.thePosteriorHasAVariance();
        scenario.aRefusalNamesTheField();
        scenario.aCloudIsDeletedOnce();
    }

    private void aCloudIsRegisteredAndListed() throws ApiException {
        String id = clouds.createCloud(new CloudRequest().points(POINTS)).getCloudId();
        check(id.equals(CLOUD_ID), id);
        var listed = clouds.listClouds(1000, null).getClouds();
        check(listed.stream().anyMatch(cloud -> cloud.getCloudId().equals(id) && cloud.getnPoints() == 8), listed);
    }

    private void normalsPointOutward() throws ApiException {
        // Without an id, as the first request of a newcomer: normals and variances of the noise are sent
        // empty.
        CloudInput inline = new CloudInput().points(POINTS);
        NormalsRequest request = new NormalsRequest().cloud(inline).queries(POINTS).kernel(gauss(2.0)).alpha(0.0);
        List<List<Double>> normals = geometry.computeNormals(request).getNormals();
        check(normals.size() == POINTS.size(), normals);
        for (int i = 0; i < normals.size(); i++) {
            check(dot(normals.get(i), POINTS.get(i)) > 0.999, normals.get(i));
        }
    }

    private void curvaturesAreNullAtTheCentre() throws ApiException {
        List<List<Double>> queries = List.of(List.of(1.0, 0.0), List.of(0.0, 0.0));
        CurvaturesRequest request = new CurvaturesRequest().cloud(cloud()).queries(queries);
        var answer = geometry.computeCurvatures(request.kernel(gauss(2.0)).alpha(0.0));
        List<Double> curvatures = answer.getMeanCurvatures();
        check(Math.abs(curvatures.get(0) - 1) < 1e-6, curvatures);
        check(curvatures.get(1) == null && answer.getFlags().get(0).getQuery() == 1, answer);
    }

    private void theMatrixTurnsCosinesIntoTheirNegatives() throws ApiException {
        var request = new LaplaceBeltramiMatrixRequest().cloud(cloud()).queries(POINTS);
        request.kernel(gauss(2.0)).alpha(0.0);
        List<List<Double>> matrix = new OperatorsApi(client).assembleLaplaceBeltramiMatrix(request).getMatrix();
        check(matrix.size() == POINTS.size(), matrix);
        for (int i = 0; i < matrix.size(); i++) {
            // Eight points on the circle take a wave of frequency 7 for a cosine, which adds the fraction
            // 48 I_7(1/2)/I_1(1/2) = 2.3e-6. The Bessel functions I_k are the Fourier coefficients of this
            // kernel on the circle, up to a factor.
            double applied = dot(matrix.get(i), COSINES);
            check(Math.abs(applied + COSINES.get(i)) < 5e-6, "row " + i + ": " + applied);
        }
    }

    private void thePosteriorHasAVariance() throws ApiException {
        PosteriorRequest request = new PosteriorRequest().cloud(cloud()).values(COSINES).alpha(1e-6);
        request.queries(List.of(List.of(0.9, 0.1))).include(List.of(PosteriorQuantity.VARIANCES));
        var answer = new ValuesApi(client).computePosterior(request);
        check(answer.getMeans().size() == 1 && answer.getVariances().size() == 1, answer);
        check(answer.getVariances().get(0) >= 0, answer);
    }

    private void aRefusalNamesTheField() {
        CurvaturesRequest request = new CurvaturesRequest().cloud(cloud()).queries(POINTS).kernel(gauss(-1.0));
        Problem problem = refusal(422, () -> geometry.computeCurvatures(request));
        check(problem.getType().equals("/problems/invalid-request"), problem);
        check(problem.getErrors().get(0).getPointer().equals("/kernel/length_scale"), problem);
    }

    private void aCloudIsDeletedOnce() throws ApiException {
        clouds.checkCloud(CLOUD_ID);
        clouds.deleteCloud(CLOUD_ID);
        Problem problem = refusal(404, () -> clouds.deleteCloud(CLOUD_ID));
        check(problem.getType().equals("/problems/unknown-cloud"), problem);
    }

    private interface Call {
        void run() throws ApiException;
    }

    private static Problem refusal(int status, Call call) {
        try {
            call.run();
        } catch (ApiException refused) {
            check(refused.getCode() == status, refused);
            return JSON.deserialize(refused.getResponseBody(), Problem.class);
        }
        throw new AssertionError("this should be refused");
    }

    /** A cloud is referred to by its id or given by its points. */
    private static CloudInput cloud() {
        return new CloudInput().id(CLOUD_ID).points(null);
    }

    /** exp(−r²/ℓ²) */
    private static Kernel gauss(double lengthScale) {
        return new Kernel().family(KernelFamily.GAUSS).lengthScale(lengthScale);
    }

    private static double dot(List<Double> a, List<Double> b) {
        check(a.size() == b.size(), a);
        double sum = 0;
        for (int i = 0; i < a.size(); i++) {
            sum += a.get(i) * b.get(i);
        }
        return sum;
    }

    private static void check(boolean holds, Object found) {
        if (!holds) {
            throw new AssertionError(found);
        }
    }
}
