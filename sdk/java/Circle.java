import gramian.client.ApiClient;
import gramian.client.ApiException;
import gramian.client.api.GeometryApi;
import gramian.client.model.CloudInput;
import gramian.client.model.CurvaturesRequest;
import java.util.List;
import java.util.stream.IntStream;

/** Prints the mean curvatures of a circle of radius 1. */
public class Circle {
    public static void main(String[] arguments) throws ApiException {
        // begin README
        ApiClient client = new ApiClient().setBasePath(System.getenv("GRAMIAN_URL"));
        CloudInput circle = new CloudInput().points(circle(8));
        CurvaturesRequest request = new CurvaturesRequest().cloud(circle).queries(circle(8));
        System.out.println(new GeometryApi(client).computeCurvatures(request).getMeanCurvatures());
        // end README
    }

    private static List<List<Double>> circle(int n) {
        return IntStream.range(0, n).mapToDouble(i -> 2 * Math.PI * i / n)
                .mapToObj(angle -> List.of(Math.cos(angle), Math.sin(angle))).toList();
    }
}
