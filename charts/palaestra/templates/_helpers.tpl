{{/* The name of the operator's objects. This name and the name of its Lease are fixed. So Helm refuses a second release in
     the namespace, or a second release for the whole cluster; otherwise two operators would reconcile the same jobs. */}}
{{- define "palaestra.name" -}}
palaestra-operator
{{- end }}

{{/* Labels of an object. Takes the root and the component. */}}
{{- define "palaestra.labels" -}}
{{ include "palaestra.selector" . }}
app.kubernetes.io/version: {{ .root.Chart.AppVersion | quote }}
{{- end }}

{{/* Labels that select pods. They must never change, because a Deployment's selector is immutable. */}}
{{- define "palaestra.selector" -}}
app.kubernetes.io/name: palaestra
app.kubernetes.io/component: {{ .component }}
{{- end }}

{{/* An image by its name below `images`. Takes the root and the name. */}}
{{- define "palaestra.image" -}}
{{- $image := index .root.Values.images .name -}}
{{- with .root.Values.images.registry }}{{ trimSuffix "/" . }}/{{ end -}}
{{- $image.repository -}}
{{- if $image.digest }}@{{ $image.digest }}{{ else }}:{{ $image.tag | default .root.Chart.AppVersion }}{{ end -}}
{{- end }}

{{/* The image of a container of jobs, or nothing if it equals the operator's own default. The operator has no default
     image of Webots. Takes the root and the name. */}}
{{- define "palaestra.jobImage" -}}
{{- $image := include "palaestra.image" . -}}
{{- if eq .name "webots" }}
{{- if .root.Values.images.webots.repository }}{{ $image }}{{ end -}}
{{- else if ne $image (printf "palaestra-%s:%s" .name .root.Chart.AppVersion) }}{{ $image }}{{ end -}}
{{- end }}

{{/* Pod settings that *restricted* Pod Security requires, and the user of all our images unless the cluster chooses one. */}}
{{- define "palaestra.podSecurity" -}}
runAsNonRoot: true
{{- if .Values.podSecurity.fixedUser }}
runAsUser: 65532
runAsGroup: 65532
{{- end }}
seccompProfile:
  type: RuntimeDefault
{{- end }}

{{/* Container settings that *restricted* Pod Security requires. */}}
{{- define "palaestra.containerSecurity" -}}
allowPrivilegeEscalation: false
capabilities:
  drop:
  - ALL
readOnlyRootFilesystem: true
{{- end }}

{{/* The namespace of `helm test`. */}}
{{- define "palaestra.testNamespace" -}}
{{- .Values.test.namespace | default (first .Values.watchNamespaces) | default .Release.Namespace -}}
{{- end }}

{{/* The operator's rights in the namespaces of jobs. */}}
{{- define "palaestra.jobRules" -}}
- apiGroups: [palaestra.dev]
  resources: [trainingjobs]
  verbs: [get, list, watch, delete] # delete: for ttlSecondsAfterFinished
- apiGroups: [palaestra.dev]
  resources: [trainingjobs/status]
  verbs: [patch]
# With the admission plugin OwnerReferencesPermissionEnforcement, owner references that block deletion need this right.
- apiGroups: [palaestra.dev]
  resources: [trainingjobs/finalizers]
  verbs: [update]
- apiGroups: [batch]
  resources: [jobs]
  verbs: [get, list, watch, create, patch, delete] # delete: suspended Jobs of ended replicas
- apiGroups: [""]
  resources: [pods]
  verbs: [list, watch]
# The operator evicts pods that the kubelet cannot recover; an eviction respects disruption budgets.
- apiGroups: [""]
  resources: [pods/eviction]
  verbs: [create]
- apiGroups: [""]
  resources: [configmaps]
  verbs: [get, list, watch, create]
- apiGroups: [""]
  resources: [persistentvolumeclaims]
  verbs: [get, list, watch, create, delete] # delete: claims of deleted TrainingJobs that were never bound to a volume
- apiGroups: [networking.k8s.io]
  resources: [networkpolicies]
  verbs: [list, watch, create, patch]
- apiGroups: [""]
  resources: [events]
  verbs: [get, list, create, patch] # list: events explain why a Job's pods cannot be created
# The status reports why Kueue does not admit a Job; authors of TrainingJobs often may not read Workloads.
- apiGroups: [kueue.x-k8s.io]
  resources: [workloads]
  verbs: [list]
{{- end }}
