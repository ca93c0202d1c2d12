{{- define "gramian.name" -}}
{{- if contains .Chart.Name .Release.Name }}{{ .Release.Name }}{{ else }}{{ .Release.Name }}-{{ .Chart.Name }}{{ end }}
{{- end }}

{{- define "gramian.labels" -}}
app.kubernetes.io/name: gramian
app.kubernetes.io/instance: {{ .Release.Name }}
app.kubernetes.io/version: {{ .Chart.AppVersion | quote }}
app.kubernetes.io/managed-by: {{ .Release.Service }}
helm.sh/chart: {{ .Chart.Name }}-{{ .Chart.Version }}
{{- end }}

{{- define "gramian.selector.server" -}}
app.kubernetes.io/name: gramian
app.kubernetes.io/instance: {{ .Release.Name }}
app.kubernetes.io/component: server
{{- end }}

{{- define "gramian.selector.router" -}}
app.kubernetes.io/name: gramian
app.kubernetes.io/instance: {{ .Release.Name }}
app.kubernetes.io/component: router
{{- end }}

{{/* Replicas that the router knows: all there may ever be. One that is not there yet is down. */}}
{{- define "gramian.places" -}}
{{- if .Values.autoscaling.enabled }}{{ max .Values.autoscaling.maxReplicas .Values.replicas }}{{ else }}{{ .Values.replicas }}{{ end }}
{{- end }}

{{- define "gramian.keysSecret" -}}
{{- .Values.keys.existingSecret | default (printf "%s-keys" (include "gramian.name" .)) }}
{{- end }}

{{- define "gramian.hasKeys" -}}
{{- if or .Values.keys.existingSecret .Values.keys.file }}true{{ end }}
{{- end }}

{{/* What all containers may do: nothing that a program without rights cannot. */}}
{{- define "gramian.containerSecurity" -}}
allowPrivilegeEscalation: false
readOnlyRootFilesystem: true
capabilities: {drop: [ALL]}
{{- end }}

{{- /* A setting as text. Helm reads numbers of files as floating-point, which would be written 8.589934592e+09. */}}
{{- define "gramian.text" -}}
{{- if and (kindIs "float64" .) (eq (floor .) .) }}{{ int64 . }}{{ else }}{{ toString . }}{{ end }}
{{- end }}
